#include "codecs/baselines/trajectories.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "codecs/baselines/baselines.h"
#include "codecs/coded_streams.h"
#include "codecs/field_coder.h"
#include "codecs/integer_contexts.h"
#include "codecs/rtpca_layout.h"
#include "kernels/range_coder.h"
#include "kernels/svd.h"
#include "kernels/trajectory_sum.h"

namespace batchenc {
namespace {

/// Steps of what is coded, from the step q of a coefficient.
struct TrajectorySteps {
    double coefficient = 0.0;  ///< q, world units
    double mean = 0.0;         ///< of the mean trajectory: an error there is one of all V vertices

    TrajectorySteps(const BaselineHeader& header, std::int64_t vertex_count)
        : coefficient(header.step()),
          mean(std::max(header.step() / std::sqrt(static_cast<double>(vertex_count)),
                        std::ldexp(static_cast<double>(header.largest_side), -kFinest))) {}

    static constexpr int kFinest = 24;  // binary digits that float32 holds
};

/// Finest scale of a basis, whose values are below 1.
constexpr std::int32_t kLargestScale = 4 * 22;

/// Codes three series, one a coordinate. track: [frame][axis].
void encode_track(RangeEncoder& encoder, SeriesContexts& contexts, std::span<const std::int32_t> track) {
    std::vector<std::int32_t> series(track.size() / 3);
    for (std::size_t c = 0; c < 3; ++c) {
        for (std::size_t f = 0; f < series.size(); ++f) series[f] = track[3 * f + c];
        encode_series(encoder, contexts, series);
    }
}

/// The way back, scaled by `step`. False when the stream is seen to be corrupt.
bool decode_track(RangeDecoder& decoder, SeriesContexts& contexts, double step, std::span<float> track) {
    std::vector<std::int32_t> series(track.size() / 3);
    for (std::size_t c = 0; c < 3; ++c) {
        if (!decode_series(decoder, contexts, series)) return false;
        for (std::size_t f = 0; f < series.size(); ++f)
            track[3 * f + c] = static_cast<float>(static_cast<double>(series[f]) * step);
    }
    return true;
}

/// Rounds values to multiples of a step, and replaces them by what the decoder will have.
template <typename Values>
std::vector<std::int32_t> round_in_place(Values&& values, double step) {
    std::vector<std::int32_t> levels(static_cast<std::size_t>(values.size()), 0);
    for (Eigen::Index k = 0; k < values.size(); ++k) {
        if (step > 0.0)
            levels[static_cast<std::size_t>(k)] =
                static_cast<std::int32_t>(std::lround(static_cast<double>(values(k)) / step));
        values(k) = static_cast<float>(static_cast<double>(levels[static_cast<std::size_t>(k)]) * step);
    }
    return levels;
}

// ---- encoding ----

/// What is coded of a component.
struct CodedTrajectory {
    RtpcaComponent component;                ///< its scale says the step of its basis
    std::vector<std::int32_t> basis;         ///< 3F
    std::vector<std::int32_t> coefficients;  ///< V, by vertex
};

/// 3F × V: trajectories about the centre.
ColMajorMatrixXf trajectories_of(PositionsView positions, const std::array<float, 3>& center,
                                 const Executor& executor) {
    ColMajorMatrixXf trajectories(3 * positions.frame_count(), positions.vertex_count());
    executor.for_each(positions.vertex_count(), [&](std::int64_t v) {
        float* out = trajectories.col(v).data();
        for (std::int64_t f = 0; f < positions.frame_count(); ++f) {
            for (std::size_t c = 0; c < 3; ++c) *out++ = positions.at(f, v)[c] - center[c];
        }
    });
    return trajectories;
}

tl::unexpected<Error> beyond_levels() {
    return fail(ErrorCode::kLimit, "its coefficients are beyond what the coder can hold; take fewer bits");
}

/// Scale of the basis of a component: its step is about q over the singular value, as an error of its basis
/// counts by the coefficients that it is multiplied with.
std::int32_t basis_scale(double singular_value, double step) {
    const double scale = 4.0 * std::log2(std::max(singular_value / step, 1.0));
    return static_cast<std::int32_t>(std::lround(std::min<double>(scale, kLargestScale)));
}

/// Components of which any coefficient is not zero. trajectories: without the decoded mean.
Expected<std::vector<CodedTrajectory>> coded_components(const ColMajorMatrixXf& trajectories,
                                                        std::int64_t count, double step) {
    std::vector<CodedTrajectory> coded;
    if (!(step > 0.0)) return coded;
    auto svd = truncated_svd(trajectories, count,
                             choose_svd_method(trajectories.rows(), trajectories.cols(), count));
    if (!svd) return tl::unexpected(svd.error());
    ColMajorMatrixXf& basis = svd->basis;
    if (!basis.allFinite() || !svd->singular_values.allFinite()) return beyond_levels();
    // Of each component its rounded basis, in place of the exact one, unless rounding leaves little of it: it
    // then says less than its bits are worth.
    constexpr float kMostLost = 0.25f;  // of its squares, which sum to 1
    std::vector<CodedTrajectory> all;
    for (Eigen::Index l = 0; l < basis.cols(); ++l) {
        CodedTrajectory next;
        next.component.scale = basis_scale(static_cast<double>(svd->singular_values(l)), step);
        Eigen::VectorXf rounded = basis.col(l);
        next.basis = round_in_place(rounded, static_cast<double>(next.component.basis_step()));
        if ((rounded - basis.col(l)).squaredNorm() > kMostLost) continue;
        basis.col(static_cast<Eigen::Index>(all.size())) = rounded;
        all.push_back(std::move(next));
    }
    if (all.empty()) return coded;
    basis.conservativeResize(Eigen::NoChange, static_cast<Eigen::Index>(all.size()));
    // Coefficients against the decoded basis, which make up for what its rounding has bent.
    const RowMajorMatrixXf coefficients = least_squares_coefficients(basis, trajectories);
    constexpr double kLargest = kLargestFieldValue / 2;
    for (std::size_t l = 0; l < all.size(); ++l) {
        const auto row = coefficients.row(static_cast<Eigen::Index>(l));
        const double largest = static_cast<double>(row.cwiseAbs().maxCoeff());
        if (!(largest / step < kLargest)) return beyond_levels();
        for (Eigen::Index v = 0; v < row.size(); ++v)
            all[l].coefficients.push_back(
                static_cast<std::int32_t>(std::lround(static_cast<double>(row(v)) / step)));
        const auto is_zero = [](std::int32_t level) { return level == 0; };
        if (!std::all_of(all[l].coefficients.begin(), all[l].coefficients.end(), is_zero))
            coded.push_back(std::move(all[l]));
    }
    return coded;
}

std::vector<std::uint8_t> write_basis(std::span<const std::int32_t> mean,
                                      std::span<const CodedTrajectory> coded) {
    std::vector<RtpcaComponent> components;
    for (const CodedTrajectory& trajectory : coded) components.push_back(trajectory.component);
    BitCoder list;
    code_components(list, components, 1);
    RangeEncoder encoder;
    SeriesContexts mean_contexts, contexts;
    encode_track(encoder, mean_contexts, mean);
    for (const CodedTrajectory& trajectory : coded) encode_track(encoder, contexts, trajectory.basis);
    ByteWriter out;
    append_parts(out, std::vector{list.finish(), encoder.finish()});
    return out.take();
}

std::vector<std::uint8_t> write_coefficients(std::span<const CodedTrajectory> coded,
                                             const FieldOrder& order) {
    BitCoder coder;
    FieldCoder fields;
    FieldMemory memory(order.size());
    std::vector<std::int32_t> field(order.vertices.size());
    for (const CodedTrajectory& trajectory : coded) {
        for (std::size_t place = 0; place < field.size(); ++place)
            field[place] = trajectory.coefficients[static_cast<std::size_t>(order.vertices[place])];
        fields.code(coder, order, memory, FieldPredictor::kParallelogram, field);
    }
    return coder.finish();
}

// ---- decoding ----

class TrajectoryClip final : public DecodedClip {
 public:
    explicit TrajectoryClip(const ClipInfo& info) : info_(info) {}

    const ClipInfo& info() const override { return info_; }
    const std::vector<std::int32_t>& labels() const override { return labels_; }

    Expected<void> decode(const ClipBitstream& clip, const MeshTopology& mesh, std::int32_t components,
                          std::int64_t size_limit_bytes);
    Expected<void> reconstruct(std::int64_t begin, MutablePositionsView out,
                               const Executor& executor) const override;

 private:
    Expected<void> decode_basis(std::span<const std::uint8_t> payload, const TrajectorySteps& steps,
                                std::int64_t coded);
    Expected<void> decode_coefficients(std::span<const std::uint8_t> payload, const FieldOrder& order,
                                       double step, bool whole);

    ClipInfo info_;
    std::vector<std::int32_t> labels_;  // none
    std::array<float, 3> center_{};
    std::vector<std::int32_t> vertices_;
    std::vector<float> mean_;                // 3F, about the centre
    std::vector<std::vector<float>> basis_;  // of each component that is used 3F
    std::vector<float> fields_;              // see TrajectoryCluster; there is no mean shape
};

Expected<void> TrajectoryClip::decode(const ClipBitstream& clip, const MeshTopology& mesh,
                                      std::int32_t components, std::int64_t size_limit_bytes) {
    const auto header = BaselineHeader::read(clip.payload(SectionId::kParameters));
    if (!header) return fail_within(section_name(SectionId::kParameters), header.error());
    center_ = header->center;
    // What a vertex and a frame take, and each component of them; checked before anything is made.
    const std::int64_t coded = header->components;
    const std::int64_t used = components < 0 ? coded : std::min<std::int64_t>(components, coded);
    const std::int64_t fixed_bytes = 128, bytes = fixed_bytes + 4 * used;
    if (clip.vertex_count > size_limit_bytes / 2 / bytes ||
        clip.frame_count > size_limit_bytes / 2 / (3 * bytes))
        return fail(ErrorCode::kLimit, "the clip needs more memory than allowed");
    if (coded > std::min(clip.vertex_count, 3 * clip.frame_count))
        return fail_within(section_name(SectionId::kParameters),
                           fail(ErrorCode::kCorrupt, "more components than there can be").value());
    basis_.resize(static_cast<std::size_t>(used));
    const TrajectorySteps steps(*header, clip.vertex_count);
    if (auto done = decode_basis(clip.payload(SectionId::kBasis), steps, coded); !done)
        return fail_within(section_name(SectionId::kBasis), done.error());
    if (auto done = decode_coefficients(clip.payload(SectionId::kCoefficients), mesh.field_order(),
                                        steps.coefficient, used == coded);
        !done)
        return fail_within(section_name(SectionId::kCoefficients), done.error());
    return {};
}

Expected<void> TrajectoryClip::decode_basis(std::span<const std::uint8_t> payload,
                                            const TrajectorySteps& steps, std::int64_t coded) {
    const auto corrupt = [] { return fail(ErrorCode::kCorrupt, "the basis does not decode"); };
    const auto parts = split_parts(payload, 2);
    if (!parts) return tl::unexpected(parts.error());
    std::vector<RtpcaComponent> components(static_cast<std::size_t>(coded));
    BitCoder list((*parts)[0]);
    if (!code_components(list, components, 1)) return corrupt();
    if (auto end = list.check_end(); !end) return end;
    if (static_cast<std::uint64_t>(info_.frame_count) > max_symbol_count((*parts)[1].size()))
        return corrupt();
    auto decoder = RangeDecoder::open((*parts)[1]);
    if (!decoder) return tl::unexpected(decoder.error());
    const auto values = static_cast<std::size_t>(3 * info_.frame_count);
    SeriesContexts mean_contexts, contexts;
    mean_.resize(values);
    if (!decode_track(*decoder, mean_contexts, steps.mean, mean_)) return corrupt();
    for (std::size_t l = 0; l < basis_.size(); ++l) {
        basis_[l].resize(values);
        if (!decode_track(*decoder, contexts, static_cast<double>(components[l].basis_step()), basis_[l]))
            return corrupt();
    }
    if (basis_.size() < components.size()) return {};
    return decoder->finish();
}

Expected<void> TrajectoryClip::decode_coefficients(std::span<const std::uint8_t> payload,
                                                   const FieldOrder& order, double step, bool whole) {
    vertices_.resize(order.vertices.size());
    std::iota(vertices_.begin(), vertices_.end(), 0);
    const auto components = static_cast<std::int64_t>(basis_.size());
    const std::int64_t blocks = (info_.vertex_count + kTrajectoryLanes - 1) / kTrajectoryLanes;
    fields_.assign(static_cast<std::size_t>(blocks * (3 + components) * kTrajectoryLanes), 0.0f);
    BitCoder coder(payload);
    FieldCoder fields;
    FieldMemory memory(order.size());
    std::vector<std::int32_t> field(order.vertices.size());
    for (std::int64_t l = 0; l < components; ++l) {
        fields.code(coder, order, memory, {}, field);
        if (coder.is_overrun()) return fail(ErrorCode::kCorrupt, "the coefficients do not decode");
        for (std::size_t place = 0; place < field.size(); ++place)
            fields_[TrajectoryCluster::field_index(order.vertices[place], 3 + l, components)] =
                static_cast<float>(static_cast<double>(field[place]) * step);
    }
    if (!whole) return {};
    return coder.check_end();
}

Expected<void> TrajectoryClip::reconstruct(std::int64_t begin, MutablePositionsView out,
                                           const Executor& executor) const {
    if (auto good = check_frames(info_, begin, out); !good) return good;
    const TrajectoryCluster geometry = {vertices_, fields_.data(), static_cast<std::int64_t>(basis_.size())};
    executor.for_each(out.frame_count(), [&](std::int64_t f) {
        const auto at = static_cast<std::size_t>(3 * (begin + f));
        std::vector<float> weights(9 + 3 * basis_.size(), 0.0f);
        std::array<float, 3> origin;
        for (std::size_t c = 0; c < 3; ++c) {
            origin[c] = center_[c] + mean_[at + c];
            for (std::size_t l = 0; l < basis_.size(); ++l) weights[9 + 3 * l + c] = basis_[l][at + c];
        }
        sum_trajectories(geometry, weights.data(), origin.data(), out.at(f, 0));
    });
    return {};
}

}  // namespace

Expected<EncodedClip> encode_trajectory_baseline(PositionsView positions, const MeshTopology& mesh,
                                                 const CodecParameters& parameters, BaselineHeader header,
                                                 const Executor& executor) {
    ColMajorMatrixXf trajectories = trajectories_of(positions, header.center, executor);
    Eigen::VectorXf mean = trajectories.cast<double>().rowwise().mean().cast<float>();
    const TrajectorySteps steps(header, positions.vertex_count());
    const std::vector<std::int32_t> mean_levels = round_in_place(mean, steps.mean);
    trajectories.colwise() -= mean;
    const auto coded = coded_components(trajectories, parameters.components, steps.coefficient);
    if (!coded) return tl::unexpected(coded.error());
    header.components = static_cast<std::int32_t>(coded->size());
    std::vector<SectionPayload> sections;
    sections.emplace_back(SectionId::kParameters, header.write());
    sections.emplace_back(SectionId::kBasis, write_basis(mean_levels, *coded));
    sections.emplace_back(SectionId::kCoefficients, write_coefficients(*coded, mesh.field_order()));
    EncodedClip clip;
    clip.bitstream = write_clip_bitstream(CodecMethod::kBaselineCoddyac, positions.vertex_count(),
                                          positions.frame_count(), sections);
    return clip;
}

Expected<std::unique_ptr<DecodedClip>> decode_trajectory_baseline(const ClipBitstream& clip,
                                                                  const SharedMesh& mesh,
                                                                  std::int32_t components,
                                                                  std::int64_t size_limit_bytes) {
    const auto info = read_baseline_info(clip);
    if (!info) return tl::unexpected(info.error());
    auto decoded = std::make_unique<TrajectoryClip>(*info);
    if (auto done = decoded->decode(clip, *mesh, components, size_limit_bytes); !done)
        return tl::unexpected(done.error());
    return decoded;
}

}  // namespace batchenc
