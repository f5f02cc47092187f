#include "codecs/baselines/wavelets.h"

#include <array>
#include <cmath>

#include "codecs/baselines/baseline_header.h"
#include "codecs/baselines/baselines.h"
#include "codecs/baselines/lane_groups.h"
#include "codecs/baselines/level_grid.h"
#include "codecs/baselines/mesh_levels.h"
#include "codecs/kept_frames.h"

namespace batchenc {
namespace {

/// Frames that can be transformed together.
constexpr std::int64_t kMostFrames = std::int64_t{1} << 28;

/// The samples that one level works on: every stride-th row.
struct Samples {
    float* values;
    std::int64_t count, stride;

    /// Sample i, which may lie beyond either end; what lies there has the same parity.
    float* at(std::int64_t i) const {
        while (i < 0 || i >= count) i = i < 0 ? -i : 2 * (count - 1) - i;
        return values + i * stride * kDctLanes;
    }
};

/// Takes from odd samples what their even neighbours say of them, or gives it back. sign: -1 or 1.
void predict(const Samples& samples, float sign) {
    constexpr float kNear = 9.0f / 16.0f, kFar = 1.0f / 16.0f;
    for (std::int64_t i = 1; i < samples.count; i += 2) {
        const float *a = samples.at(i - 3), *b = samples.at(i - 1), *c = samples.at(i + 1),
                    *d = samples.at(i + 3);
        float* value = samples.at(i);
        for (std::int64_t l = 0; l < kDctLanes; ++l)
            value[l] += sign * (kNear * (b[l] + c[l]) - kFar * (a[l] + d[l]));
    }
}

/// Adds to even samples a quarter of the details beside them, or takes it away.
void update(const Samples& samples, float sign) {
    for (std::int64_t i = 0; i < samples.count; i += 2) {
        const float *a = samples.at(i - 1), *b = samples.at(i + 1);
        float* value = samples.at(i);
        for (std::int64_t l = 0; l < kDctLanes; ++l) value[l] += sign * (0.25f * (a[l] + b[l]));
    }
}

/// The quantisation step of each entry of the row order: an error of one step in a coefficient of any band
/// adds as much to the sum of squares over the clip.
std::vector<double> steps_of(const LiftedWavelet& wavelet, double step) {
    std::vector<double> steps;
    for (std::int64_t entry = 0; entry < wavelet.length(); ++entry)
        steps.push_back(step / wavelet.gains()[static_cast<std::size_t>(wavelet.band(entry))]);
    return steps;
}

/// Entry of each row in the row order.
std::vector<std::int64_t> entries_of(const LiftedWavelet& wavelet) {
    std::vector<std::int64_t> entries(wavelet.row_order().size());
    for (std::size_t entry = 0; entry < entries.size(); ++entry)
        entries[static_cast<std::size_t>(wavelet.row_order()[entry])] = static_cast<std::int64_t>(entry);
    return entries;
}

}  // namespace

LiftedWavelet::LiftedWavelet(std::int64_t length) : length_(length), low_count_(length) {
    for (; low_count_ > kLowest; ++levels_) low_count_ = (low_count_ + 1) / 2;
    row_order_.reserve(static_cast<std::size_t>(length));
    for (std::int64_t i = 0; i < low_count_; ++i) row_order_.push_back(i << levels_);
    for (int level = levels_; level-- > 0;)
        for (std::int64_t row = std::int64_t{1} << level; row < length; row += std::int64_t{2} << level)
            row_order_.push_back(row);

    std::vector<float> values(static_cast<std::size_t>(length * kDctLanes));
    for (int first = 0; first <= levels_; first += static_cast<int>(kDctLanes)) {
        const int count = std::min(levels_ + 1 - first, static_cast<int>(kDctLanes));
        std::fill(values.begin(), values.end(), 0.0f);
        for (int lane = 0; lane < count; ++lane) {
            std::int64_t begin = 0, end = 0;
            while (end < length && band(end) <= first + lane) begin += band(end++) < first + lane ? 1 : 0;
            const std::int64_t row = row_order_[static_cast<std::size_t>((begin + end) / 2)];
            values[static_cast<std::size_t>(row * kDctLanes + lane)] = 1.0f;
        }
        inverse(values.data());
        for (int lane = 0; lane < count; ++lane) {
            double sum = 0.0;
            for (std::int64_t row = 0; row < length; ++row) {
                const double value = values[static_cast<std::size_t>(row * kDctLanes + lane)];
                sum += value * value;
            }
            gains_.push_back(std::sqrt(sum));
        }
    }
}

int LiftedWavelet::band(std::int64_t entry) const {
    const std::int64_t row = row_order_[static_cast<std::size_t>(entry)];
    return entry < low_count_ ? 0 : levels_ - __builtin_ctzll(static_cast<std::uint64_t>(row));
}

void LiftedWavelet::forward(float* values) const {
    Samples samples{values, length_, 1};
    for (int level = 0; level < levels_; ++level) {
        predict(samples, -1.0f);
        update(samples, 1.0f);
        samples = {values, (samples.count + 1) / 2, 2 * samples.stride};
    }
}

void LiftedWavelet::inverse(float* values) const {
    for (int level = levels_; level-- > 0;) {
        const std::int64_t stride = std::int64_t{1} << level;
        const Samples samples{values, (length_ + stride - 1) / stride, stride};
        update(samples, -1.0f);
        predict(samples, 1.0f);
    }
}

Expected<EncodedClip> encode_wavelets(PositionsView positions, const MeshTopology& mesh,
                                      const BaselineHeader& header, const Executor& executor) {
    if (positions.frame_count() > kMostFrames) return fail(ErrorCode::kLimit, "the clip has too many frames");
    const LiftedWavelet wavelet(positions.frame_count());
    const std::vector<double> steps = steps_of(wavelet, header.step());
    const std::vector<std::int64_t> entries = entries_of(wavelet);
    const MeshTraversal& traversal = mesh.traversal();
    const auto width = static_cast<std::size_t>(3 * positions.vertex_count());
    std::vector<std::int32_t> levels(static_cast<std::size_t>(positions.value_count()));
    transform_signals(
        positions.frame_count(), static_cast<std::int64_t>(width), executor,
        [&](std::int64_t row, std::int64_t signal) {
            const std::int32_t v = traversal.order[static_cast<std::size_t>(signal / 3)];
            return positions.at(row, v)[signal % 3] - header.center[static_cast<std::size_t>(signal % 3)];
        },
        [&](float* values) { wavelet.forward(values); },
        [&](std::int64_t row, std::int64_t signal, float value) {
            const auto entry = static_cast<std::size_t>(entries[static_cast<std::size_t>(row)]);
            levels[entry * width + static_cast<std::size_t>(signal)] = nearest_level(value, steps[entry]);
        });
    if (!is_codable(levels)) return fail(ErrorCode::kLimit, "the motion is larger than the coder can hold");

    const std::size_t low_levels = static_cast<std::size_t>(wavelet.low_count()) * width;
    const std::span<std::int32_t> low = std::span(levels).first(low_levels);
    take_predictions(traversal, LevelPrediction::kParallelogram, low);
    std::vector<SectionPayload> sections;
    sections.emplace_back(SectionId::kParameters, header.write());
    sections.emplace_back(SectionId::kCoefficients, encode_level_grid(low, positions.vertex_count()));
    if (wavelet.level_count() > 0)
        sections.emplace_back(SectionId::kResiduals,
                              write_predicted_grid(traversal, LevelPrediction::kParallelogram,
                                                   std::span(levels).subspan(low_levels)));
    EncodedClip clip;
    clip.bitstream = write_clip_bitstream(CodecMethod::kBaselineWavelet, positions.vertex_count(),
                                          positions.frame_count(), sections);
    return clip;
}

Expected<std::unique_ptr<DecodedClip>> decode_wavelets(const ClipBitstream& clip, const SharedMesh& mesh,
                                                       std::int64_t size_limit_bytes,
                                                       const Executor& executor) {
    const auto info = read_baseline_info(clip);
    if (!info) return tl::unexpected(info.error());
    const BaselineHeader header = *BaselineHeader::read(clip.payload(SectionId::kParameters));
    // A vertex in a frame has its position and three levels; a frame a row of lanes and its step and place.
    constexpr std::int64_t kBytesPerVertex = 640, kBytesPerSample = 24, kBytesPerFrame = 256;
    if (auto good = check_size(clip, size_limit_bytes, kBytesPerVertex, kBytesPerSample); !good)
        return tl::unexpected(good.error());
    if (clip.frame_count > std::min(kMostFrames, size_limit_bytes / kBytesPerFrame))
        return fail(ErrorCode::kLimit, "the clip has too many frames for the memory allowed");
    const auto low_bytes = clip.payload(SectionId::kCoefficients);
    const auto detail_bytes = clip.payload(SectionId::kResiduals);
    const LiftedWavelet wavelet(clip.frame_count);
    auto low = decode_level_grid(low_bytes, wavelet.low_count(), clip.vertex_count);
    if (!low) return fail_within(section_name(SectionId::kCoefficients), low.error());
    std::vector<std::int32_t> details;
    if (wavelet.level_count() > 0) {
        auto grid = read_predicted_grid(detail_bytes, mesh->traversal(), LevelPrediction::kParallelogram,
                                        clip.frame_count - wavelet.low_count());
        if (!grid) return fail_within(section_name(SectionId::kResiduals), grid.error());
        details = std::move(*grid);
    } else if (!detail_bytes.empty()) {
        return fail(ErrorCode::kCorrupt, "so few frames have no details");
    }

    const MeshTraversal& traversal = mesh->traversal();
    const auto width = static_cast<std::size_t>(3 * clip.vertex_count);
    add_predictions(traversal, LevelPrediction::kParallelogram, *low);
    const std::vector<double> steps = steps_of(wavelet, header.step());
    const std::vector<std::int64_t> entries = entries_of(wavelet);
    auto decoded = std::make_unique<KeptFrames>(*info);
    const MutablePositionsView frames = decoded->frames();
    transform_signals(
        clip.frame_count, 3 * clip.vertex_count, executor,
        [&](std::int64_t row, std::int64_t signal) {
            const auto entry = static_cast<std::size_t>(entries[static_cast<std::size_t>(row)]);
            const std::size_t k = entry * width + static_cast<std::size_t>(signal);
            const std::int32_t level = k < low->size() ? (*low)[k] : details[k - low->size()];
            return static_cast<float>(static_cast<double>(level) * steps[entry]);
        },
        [&](float* values) { wavelet.inverse(values); },
        [&](std::int64_t row, std::int64_t signal, float value) {
            const std::int32_t v = traversal.order[static_cast<std::size_t>(signal / 3)];
            frames.at(row, v)[signal % 3] = value + header.center[static_cast<std::size_t>(signal % 3)];
        });
    return decoded;
}

}  // namespace batchenc
