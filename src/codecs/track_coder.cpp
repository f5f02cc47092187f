#include "codecs/track_coder.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "codecs/rate_model.h"
#include "kernels/steady_math.h"

namespace batchenc {
namespace {

constexpr std::size_t kAxes = 3;
constexpr std::size_t kPadding = 8;  // zeros before and behind the magnitudes of a block

constexpr std::size_t kFrequencies = 16;
constexpr std::size_t kRanks = 4;

constexpr std::size_t kCoarseClasses = kSizeClasses / 2;

constexpr float kLargestTransformed = 0x1p28f;  // of what is quantised

std::size_t coarse_class(std::int64_t expected) { return size_class(expected) / 2; }

std::int32_t wrap(std::int64_t value) { return static_cast<std::int32_t>(static_cast<std::uint32_t>(value)); }

/// A residual that MixedIntegers takes, of whatever a corrupt stream has made before it.
std::int32_t clamp_residual(std::int64_t value) {
    return static_cast<std::int32_t>(
        std::clamp<std::int64_t>(value, -MixedIntegers::kLargest, MixedIntegers::kLargest));
}

/// What the value at frame f is predicted to be from those before it.
std::int32_t predict_value(TrackForm form, const std::int32_t* values, std::int64_t f) {
    if (f == 0) return 0;
    if (form == TrackForm::kSteps || f == 1) return values[f - 1];
    return wrap(2 * std::int64_t{values[f - 1]} - values[f - 2]);
}

/// Magnitudes around a level: of its own block so far, and of the block before.
struct Surroundings {
    const std::int32_t* present;  // of this axis, at frequency 0
    const std::int32_t* past;
    std::array<const std::int32_t*, kAxes> axes;  // present of all axes
    std::size_t axis;

    /// Magnitudes of the other axes near frequency j, in sixteenths of their mean.
    std::int64_t beside(std::int64_t j) const {
        switch (axis) {
            case 0:
                return 8 * (std::int64_t{axes[1][j - 1]} + axes[2][j - 1]);
            case 1:
                return 10 * std::int64_t{axes[0][j]} + 6 * axes[2][j - 1];
            default:
                return 8 * (std::int64_t{axes[0][j]} + axes[1][j]);
        }
    }
    std::int64_t before(std::int64_t j) const {  // in sixteenths
        return 6 * std::int64_t{present[j - 1]} + 4 * present[j - 2] + 3 * present[j - 3] +
               2 * present[j - 4] + present[j - 5];
    }
    std::int64_t earlier(std::int64_t j) const {  // in sixteenths
        return 8 * std::int64_t{past[j]} + 4 * (std::int64_t{past[j - 1]} + past[j + 1]);
    }
    /// In 512ths.
    std::int64_t expected(std::int64_t j, bool has_past) const {
        const std::int64_t here = 12 * before(j) + 4 * beside(j);  // 256ths
        return has_past ? here + 16 * earlier(j) : 2 * here;
    }
};

/// Magnitudes of the axes of a block, padded.
class BlockSizes {
 public:
    explicit BlockSizes(std::int64_t longest)
        : stride_(static_cast<std::size_t>(longest) + 2 * kPadding),
          present_(kAxes * stride_),
          past_(kAxes * stride_) {}

    void clear() {
        std::fill(present_.begin(), present_.end(), 0);
        std::fill(past_.begin(), past_.end(), 0);
    }
    void next_block() {
        std::swap(present_, past_);
        std::fill(present_.begin(), present_.end(), 0);
    }
    void set(std::size_t axis, std::int64_t j, std::int32_t level) {
        present_[at(axis) + static_cast<std::size_t>(j)] = bounded_magnitude(level);
    }
    Surroundings around(std::size_t axis) const {
        return {present_.data() + at(axis),
                past_.data() + at(axis),
                {present_.data() + at(0), present_.data() + at(1), present_.data() + at(2)},
                axis};
    }

 private:
    std::size_t at(std::size_t axis) const { return axis * stride_ + kPadding; }
    std::size_t stride_;
    std::vector<std::int32_t> present_, past_;
};

/// Where in the spectrum a frequency lies, about four classes an octave of cycles a frame at the low end.
std::size_t frequency_class(std::int64_t j, std::int64_t length) {
    const std::int64_t position = 256 * j / length;  // 0 … 255
    std::size_t c = 0;
    while (c + 1 < kFrequencies &&
           position >= (std::int64_t{2} << (c / 2)) + (c % 2 == 0 ? 0 : std::int64_t{1} << (c / 2)))
        ++c;
    return c;
}

}  // namespace

std::int32_t MeanPrediction::operator()(const std::int32_t* levels, std::int64_t length_before,
                                        std::int64_t length) {
    const std::vector<double>& weights = weights_of(length_before);
    double end = static_cast<double>(levels[0]);
    for (std::int64_t j = 1; j < length_before; ++j) {
        if (levels[j] != 0) end += weights[static_cast<std::size_t>(j)] * static_cast<double>(levels[j]);
    }
    const double scaled = end * std::sqrt(static_cast<double>(length) / static_cast<double>(length_before));
    return static_cast<std::int32_t>(std::floor(std::clamp(scaled, -1073741824.0, 1073741824.0) + 0.5));
}

const std::vector<double>& MeanPrediction::weights_of(std::int64_t length) {
    for (const std::vector<double>& weights : weights_) {
        if (weights.size() == static_cast<std::size_t>(length)) return weights;
    }
    std::vector<double> weights(static_cast<std::size_t>(length));
    const double turn = std::numbers::pi / (2.0 * static_cast<double>(length));
    for (std::int64_t j = 0; j < length; ++j) {
        const double wave = unit_vector(turn * static_cast<double>(j)).cosine;
        weights[static_cast<std::size_t>(j)] = (j % 2 == 0 ? wave : -wave) * std::numbers::sqrt2;
    }
    return weights_.emplace_back(std::move(weights));
}

TrackBlocks::TrackBlocks(std::int64_t frame_count, TrackForm form) : frames(frame_count) {
    const std::int64_t length =
        form <= TrackForm::kSlopes ? 1 : std::int64_t{8} << (static_cast<int>(form) - 2);
    count = std::max<std::int64_t>(1, (frame_count + length / 2) / length);
}

TrackCoder::TrackCoder(std::int64_t frame_count)
    : frame_count_(frame_count),
      transformed_{kSizeClasses * 3, kCoarseClasses * kCoarseClasses, kFrequencies * kTrackForms,
                   kSizeClasses * kRanks, kCoarseClasses * kFrequencies},
      first_{kSizeClasses * kTrackForms, kRanks * kTrackForms},
      stepped_{kSizeClasses * 3, kCoarseClasses * kCoarseClasses, kCoarseClasses * kCoarseClasses,
               kSizeClasses * kRanks} {}

void TrackCoder::code(BitCoder& coder, TrackLevels& track, std::size_t rank) {
    track.form = static_cast<TrackForm>(forms_.code(coder, static_cast<std::uint32_t>(track.form)));
    if (track.form <= TrackForm::kSlopes)
        code_values(coder, track, std::min(rank, kRanks - 1));
    else
        code_blocks(coder, track, std::min(rank, kRanks - 1));
}

void TrackCoder::code_values(BitCoder& coder, TrackLevels& track, std::size_t rank) {
    const std::int64_t n = frame_count_;
    std::array<std::array<std::int64_t, 4>, kAxes> last{};  // magnitudes of residuals, the latest first
    std::array<std::int64_t, kAxes> mean{};                 // running, sixteenths
    for (std::int64_t f = 0; f < n; ++f) {
        for (std::size_t axis = 0; axis < kAxes; ++axis) {
            std::int32_t* values = track.values.data() + static_cast<std::int64_t>(axis) * n;
            const auto& own = last[axis];
            const std::int64_t near = 7 * own[0] + 5 * own[1] + 3 * own[2] + own[3];  // sixteenths
            const std::int64_t beside = 8 * (last[(axis + 1) % 3][0] + last[(axis + 2) % 3][0]);
            const std::int64_t both = 24 * near + 8 * beside;
            const std::array<std::size_t, 4> contexts = {
                size_class(both) * 3 + axis,
                coarse_class(32 * near) * kCoarseClasses + coarse_class(32 * beside),
                coarse_class(512 * own[0]) * kCoarseClasses + coarse_class(512 * own[1]),
                size_class(32 * mean[axis]) * kRanks + rank};
            const std::int32_t predicted = predict_value(track.form, values, f);
            const std::int32_t residual =
                stepped_.code(coder, clamp_residual(std::int64_t{values[f]} - predicted), contexts);
            values[f] = wrap(std::int64_t{predicted} + residual);
            last[axis] = {bounded_magnitude(residual), own[0], own[1], own[2]};
            mean[axis] += (16 * last[axis][0] - mean[axis] + 4) >> 3;
        }
    }
}

void TrackCoder::code_blocks(BitCoder& coder, TrackLevels& track, std::size_t rank) {
    const std::int64_t n = frame_count_;
    const TrackBlocks blocks(n, track.form);
    const auto form = static_cast<std::size_t>(track.form);
    BlockSizes sizes((n + blocks.count - 1) / blocks.count);
    std::int64_t mean = 0, first_size = 0;  // running, sixteenths
    for (std::int64_t b = 0; b < blocks.count; ++b) {
        const std::int64_t begin = blocks.begin(b), length = blocks.begin(b + 1) - begin;
        if (b > 0) sizes.next_block();
        for (std::int64_t j = 0; j < length; ++j) {
            const std::size_t frequency = frequency_class(j, length);
            for (std::size_t axis = 0; axis < kAxes; ++axis) {
                std::int32_t& level =
                    track.values[axis * static_cast<std::size_t>(n) + static_cast<std::size_t>(begin + j)];
                if (j == 0) {  // the mean, against the end of the block before
                    const std::int64_t before = b > 0 ? blocks.begin(b - 1) : 0;
                    const std::int32_t predicted =
                        b == 0 ? 0
                               : predict_mean_(
                                     track.values.data() + static_cast<std::int64_t>(axis) * n + before,
                                     begin - before, length);
                    const std::array<std::size_t, 2> contexts = {
                        size_class(b == 0 ? 0 : 32 * first_size + 16) * kTrackForms + form,
                        rank * kTrackForms + form};
                    const std::int32_t residual =
                        first_.code(coder, clamp_residual(std::int64_t{level} - predicted), contexts);
                    level = wrap(std::int64_t{predicted} + residual);
                    sizes.set(axis, 0, residual);
                    first_size += (16 * bounded_magnitude(residual) - first_size + 2) >> 2;
                    continue;
                }
                const Surroundings around = sizes.around(axis);
                const std::int64_t expected = around.expected(j, b > 0);
                const std::int64_t before = around.before(j);
                const std::array<std::size_t, 5> contexts = {
                    size_class(expected) * 3 + axis,
                    coarse_class(32 * around.earlier(j)) * kCoarseClasses + coarse_class(32 * before),
                    frequency * kTrackForms + form, size_class(32 * mean) * kRanks + rank,
                    coarse_class(32 * around.beside(j)) * kFrequencies + frequency};
                level = transformed_.code(coder, level, contexts);
                sizes.set(axis, j, level);
                mean += (16 * bounded_magnitude(level) - mean + 4) >> 3;
            }
        }
    }
}

TrackTransform::TrackTransform(std::int64_t frame_count) : frame_count_(frame_count) {
    for (std::size_t form = 2; form < kTrackForms; ++form) {
        const TrackBlocks blocks(frame_count, static_cast<TrackForm>(form));
        for (const std::int64_t length :
             {frame_count / blocks.count, (frame_count + blocks.count - 1) / blocks.count}) {
            const auto same = [&](const std::unique_ptr<Dct>& dct) { return dct->length() == length; };
            if (std::none_of(dcts_.begin(), dcts_.end(), same))
                dcts_.push_back(std::make_unique<Dct>(length));
        }
    }
}

const Dct& TrackTransform::dct_of(std::int64_t length) const {
    return **std::find_if(dcts_.begin(), dcts_.end(),
                          [&](const std::unique_ptr<Dct>& dct) { return dct->length() == length; });
}

/// As many tracks as a transform takes at once, frame by frame.
struct TrackTransform::Lanes {
    static constexpr std::size_t kTracks = static_cast<std::size_t>(kDctLanes) / kAxes;

    explicit Lanes(std::int64_t frame_count) : values(static_cast<std::size_t>(frame_count * kDctLanes)) {}
    float* frame(std::int64_t f) { return values.data() + f * kDctLanes; }
    static std::int64_t tasks(std::size_t tracks) {
        return static_cast<std::int64_t>((tracks + kTracks - 1) / kTracks);
    }

    std::vector<float> values;
};

namespace {

/// Levels of one track in one form from its (transformed) values; the cost they are thought to have.
class TrackQuantizer {
 public:
    explicit TrackQuantizer(std::int64_t frame_count)
        : frame_count_(frame_count), sizes_(frame_count), rates_(RateModel::get()) {}

    /// values(f, axis): in steps.
    template <typename Values>
    float operator()(TrackForm form, Values values, std::vector<std::int32_t>& levels) {
        return form <= TrackForm::kSlopes ? step(form, values, levels) : block(form, values, levels);
    }

 private:
    template <typename Values>
    float step(TrackForm form, Values values, std::vector<std::int32_t>& levels) {
        float cost = 0.0f;
        for (std::size_t axis = 0; axis < kAxes; ++axis) {
            std::int32_t* out = levels.data() + static_cast<std::int64_t>(axis) * frame_count_;
            std::int64_t size = 0;  // running mean of residuals, sixteenths
            for (std::int64_t f = 0; f < frame_count_; ++f) {
                const std::int32_t predicted = predict_value(form, out, f);
                const RateModel::Choice choice =
                    rates_.choose(values(f, axis), predicted, expectation_class(32 * size + 16));
                out[f] = choice.value;
                if (f > 0) cost += choice.cost;
                size += (16 * std::int64_t{bounded_magnitude(wrap(std::int64_t{choice.value} - predicted))} -
                         size + 2) >>
                        2;
            }
        }
        return cost;
    }

    template <typename Values>
    float block(TrackForm form, Values values, std::vector<std::int32_t>& levels) {
        const TrackBlocks blocks(frame_count_, form);
        float cost = 0.0f;
        sizes_.clear();
        for (std::int64_t b = 0; b < blocks.count; ++b) {
            const std::int64_t begin = blocks.begin(b), length = blocks.begin(b + 1) - begin;
            if (b > 0) sizes_.next_block();
            for (std::int64_t j = 0; j < length; ++j) {
                for (std::size_t axis = 0; axis < kAxes; ++axis) {
                    std::int32_t* out = levels.data() + static_cast<std::int64_t>(axis) * frame_count_;
                    const Surroundings around = sizes_.around(axis);
                    std::int32_t predicted = 0;
                    std::int64_t expected = 0;
                    if (j > 0) {
                        expected = around.expected(j, b > 0);
                    } else if (b > 0) {
                        const std::int64_t before = blocks.begin(b - 1);
                        predicted = predict_mean_(out + before, begin - before, length);
                        expected = 512 * std::int64_t{around.past[0]} / 2 + 256;
                    }
                    RateModel::Choice choice =
                        rates_.choose(values(begin + j, axis), predicted, expectation_class(expected + 8));
                    out[begin + j] = choice.value;
                    sizes_.set(axis, j, wrap(std::int64_t{choice.value} - predicted));
                    if (begin + j > 0) cost += choice.cost;
                }
            }
        }
        return cost;
    }

    std::int64_t frame_count_;
    BlockSizes sizes_;
    MeanPrediction predict_mean_;
    const RateModel& rates_;
};

}  // namespace

std::vector<TrackLevels> TrackTransform::quantize(std::span<const std::vector<float>> tracks,
                                                  const Executor& executor) const {
    std::vector<TrackLevels> chosen(tracks.size());
    executor.for_each(Lanes::tasks(tracks.size()), [&](std::int64_t task) {
        const std::size_t first = static_cast<std::size_t>(task) * Lanes::kTracks;
        const std::size_t count = std::min(Lanes::kTracks, tracks.size() - first);
        Lanes source(frame_count_), lanes(frame_count_);
        for (std::size_t t = 0; t < count; ++t) {
            for (std::int64_t f = 0; f < frame_count_; ++f)
                std::copy_n(tracks[first + t].data() + 3 * f, kAxes, source.frame(f) + t * kAxes);
        }
        TrackQuantizer quantizer(frame_count_);
        std::vector<float> workspace;
        std::vector<std::int32_t> levels(kAxes * static_cast<std::size_t>(frame_count_));
        std::vector<float> least(count, std::numeric_limits<float>::infinity());
        std::vector<float> largest(count, 0.0f);
        for (std::size_t t = 0; t < count; ++t) {
            for (const float value : tracks[first + t]) largest[t] = std::max(largest[t], std::abs(value));
        }
        std::int64_t last_count = 0;
        for (std::size_t f = kTrackForms;
             f-- > 0;) {  // long blocks first, so that they win where all are one
            const auto form = static_cast<TrackForm>(f);
            const TrackBlocks blocks(frame_count_, form);
            if (form > TrackForm::kSlopes && blocks.count == last_count) continue;
            last_count = blocks.count;
            lanes.values = source.values;
            // A block's mean grows with the root of its length; it and what it is predicted from must fit.
            const float gain =
                form > TrackForm::kSlopes
                    ? std::sqrt(static_cast<float>((frame_count_ + blocks.count - 1) / blocks.count))
                    : 1.0f;
            for (std::int64_t b = 0; form > TrackForm::kSlopes && b < blocks.count; ++b) {
                const Dct& dct = dct_of(blocks.begin(b + 1) - blocks.begin(b));
                workspace.resize(static_cast<std::size_t>(dct.workspace_size()));
                dct.forward(lanes.frame(blocks.begin(b)), workspace.data());
            }
            for (std::size_t t = 0; t < count; ++t) {
                if (largest[t] * gain > kLargestTransformed) continue;
                const auto value = [&](std::int64_t at, std::size_t axis) {
                    return lanes.frame(at)[t * kAxes + axis];
                };
                const float cost = quantizer(form, value, levels);
                if (!(cost < least[t])) continue;
                least[t] = cost;
                chosen[first + t] = {form, levels, cost};
            }
        }
    });
    return chosen;
}

std::vector<std::vector<float>> TrackTransform::dequantize(std::span<const TrackLevels> tracks,
                                                           const Executor& executor) const {
    std::vector<std::vector<float>> values(tracks.size());
    const auto n = static_cast<std::size_t>(frame_count_);
    // Tracks of one form go through the transform together.
    std::vector<std::vector<std::size_t>> batches;
    for (std::size_t form = 0; form < kTrackForms; ++form) {
        std::size_t in_batch = Lanes::kTracks;
        for (std::size_t t = 0; t < tracks.size(); ++t) {
            if (static_cast<std::size_t>(tracks[t].form) != form) continue;
            if (in_batch == Lanes::kTracks) {
                batches.emplace_back();
                in_batch = 0;
            }
            batches.back().push_back(t);
            ++in_batch;
        }
    }
    executor.for_each(static_cast<std::int64_t>(batches.size()), [&](std::int64_t index) {
        const std::vector<std::size_t>& batch = batches[static_cast<std::size_t>(index)];
        const TrackForm form = tracks[batch[0]].form;
        Lanes lanes(frame_count_);
        for (std::size_t t = 0; t < batch.size(); ++t) {
            for (std::size_t f = 0; f < n; ++f) {
                for (std::size_t axis = 0; axis < kAxes; ++axis)
                    lanes.values[f * kDctLanes + t * kAxes + axis] =
                        static_cast<float>(tracks[batch[t]].values[axis * n + f]);
            }
        }
        if (form > TrackForm::kSlopes) {
            const TrackBlocks blocks(frame_count_, form);
            std::vector<float> workspace;
            for (std::int64_t b = 0; b < blocks.count; ++b) {
                const Dct& dct = dct_of(blocks.begin(b + 1) - blocks.begin(b));
                workspace.resize(static_cast<std::size_t>(dct.workspace_size()));
                dct.inverse(lanes.frame(blocks.begin(b)), workspace.data());
            }
        }
        for (std::size_t t = 0; t < batch.size(); ++t) {
            values[batch[t]].resize(kAxes * n);
            for (std::size_t f = 0; f < n; ++f)
                std::copy_n(lanes.values.data() + f * kDctLanes + t * kAxes, kAxes,
                            values[batch[t]].data() + kAxes * f);
        }
    });
    return values;
}

}  // namespace batchenc
