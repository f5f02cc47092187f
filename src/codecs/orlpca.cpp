#include "codecs/orlpca.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <utility>

#include "codecs/orlpca_model.h"
#include "codecs/rlpca.h"
#include "codecs/rlpca_clusters.h"
#include "kernels/error_metrics.h"
#include "kernels/rate_allocation.h"
#include "kernels/target_search.h"

namespace batchenc {
namespace {

/// Components of each cluster.
using ComponentCounts = std::vector<std::int64_t>;
using Bytes = std::vector<std::uint8_t>;

/// Share of what is left below a target that a last trial plans to use: what is expected of it is not exact.
constexpr double kTrust = 0.98;

/// A number for people.
std::string shown(double value) {
    char text[32];
    std::snprintf(text, sizeof(text), "%.6g", value);
    return text;
}

class OrlpcaEncoder {
 public:
    OrlpcaEncoder(PositionsView positions, const MeshTopology& mesh, const CodecParameters& parameters,
                  const RlpcaSource& source, const Executor& executor)
        : positions_(positions),
          mesh_(mesh),
          parameters_(parameters),
          source_(source),
          executor_(executor),
          components_(static_cast<std::size_t>(source.header().cluster_count)),
          coded_(components_.size()),
          counts_(components_.size()) {}

    Expected<void> analyse();
    Expected<Bytes> encode();

 private:
    ComponentCounts counts_after(std::int64_t steps) const;
    ComponentCounts counts_within(std::int64_t budget) const;
    ComponentCounts filled_up(std::int64_t steps, double bits_left) const;
    ComponentCounts without_last(std::int64_t steps, double error_left) const;
    Expected<Bytes> write(const ComponentCounts& counts);
    Expected<ErrorMetrics> measure(const Bytes& bitstream) const;
    Expected<Bytes> encode_to_size(double target);
    Expected<Bytes> encode_to_error(CodecTarget which, double target);

    double bits_of(std::size_t step) const { return bits_after_[step + 1] - bits_after_[step]; }
    double sample_count() const {
        return static_cast<double>(positions_.vertex_count()) * static_cast<double>(positions_.frame_count());
    }

    PositionsView positions_;
    const MeshTopology& mesh_;
    const CodecParameters& parameters_;
    const RlpcaSource& source_;
    const Executor& executor_;

    std::vector<ColMajorMatrixXf> components_;  // of each cluster 3n × L, all that there may be
    std::vector<CodedCluster> coded_;           // the first counts_ of them; fewer where the last are no use
    ComponentCounts counts_;

    std::vector<AllocationStep> steps_;  // the steepest first
    // What is thought of the first k steps, k = 0 … steps_.size().
    std::vector<double> bits_after_;   // of basis and coefficients
    std::vector<double> error_after_;  // squared, of all but the vertices of seed triangles
};

/// Takes the components of every cluster and finds in which order they are worth coding.
Expected<void> OrlpcaEncoder::analyse() {
    const RlpcaHeader& header = source_.header();
    std::vector<ComponentModel> models(components_.size());
    auto done = for_each_cluster(header.cluster_count, executor_, [&](std::size_t i) -> Expected<void> {
        const ColMajorMatrixXf matrix = source_.local_coordinates(i);
        auto components = principal_components(matrix, header.components);
        if (!components) return tl::unexpected(components.error());
        auto coded = quantize_cluster(matrix, *components, header);
        if (!coded) return tl::unexpected(coded.error());
        counts_[i] = coded->component_count;
        components_[i] = components->leftCols(counts_[i]);
        models[i] = ComponentModel::of(matrix, components_[i], header);
        coded_[i] = std::move(*coded);
        return {};
    });
    if (!done) return done;

    const auto bits = component_bits(coded_, source_.layout(), executor_);
    std::vector<std::vector<RatePoint>> by_bits(components_.size()), points;
    for (std::size_t i = 0; i < components_.size(); ++i) {
        const std::int64_t rows = components_[i].rows(), frames = positions_.frame_count();
        by_bits[i] = models[i].points_by_bits(bits[i], rows, frames);
        points.push_back(parameters_.rate == RateMeasure::kBits ? by_bits[i]
                                                                : models[i].points_by_numbers(rows, frames));
    }
    steps_ = steepest_first(points);
    bits_after_ = error_after_ = {0.0};
    for (const auto& of_cluster : points) error_after_[0] += of_cluster[0].distortion;
    ComponentCounts counts(components_.size());
    for (const AllocationStep& step : steps_) {
        const auto i = static_cast<std::size_t>(step.source);
        bits_after_.push_back(bits_after_.back() + by_bits[i][static_cast<std::size_t>(step.point)].rate -
                              by_bits[i][static_cast<std::size_t>(counts[i])].rate);
        error_after_.push_back(error_after_.back() - step.distortion);
        counts[i] = step.point;
    }
    return {};
}

/// Components of the clusters after the first so many steps.
ComponentCounts OrlpcaEncoder::counts_after(std::int64_t steps) const {
    ComponentCounts counts(components_.size());
    for (std::int64_t k = 0; k < steps; ++k) {
        const AllocationStep& step = steps_[static_cast<std::size_t>(k)];
        counts[static_cast<std::size_t>(step.source)] = step.point;
    }
    return counts;
}

/// Components of the clusters when they may be `budget` together; of the first step that is too large only
/// what is left.
ComponentCounts OrlpcaEncoder::counts_within(std::int64_t budget) const {
    ComponentCounts counts(components_.size());
    for (const AllocationStep& step : steps_) {
        std::int64_t& count = counts[static_cast<std::size_t>(step.source)];
        const std::int64_t added = std::min(step.point - count, budget);  // below 0 where fewer are as cheap
        count += added;
        budget -= added;
        if (budget == 0) break;
    }
    return counts;
}

/// The first so many steps, and of those after them the ones that fit into so many bits more; a cluster ends
/// with its first step that does not.
ComponentCounts OrlpcaEncoder::filled_up(std::int64_t steps, double bits_left) const {
    ComponentCounts counts = counts_after(steps);
    std::vector<bool> ended(counts.size());
    for (auto k = static_cast<std::size_t>(steps); k < steps_.size(); ++k) {
        const auto i = static_cast<std::size_t>(steps_[k].source);
        ended[i] = ended[i] || bits_of(k) > bits_left;
        if (ended[i]) continue;
        counts[i] = steps_[k].point;
        bits_left -= bits_of(k);
    }
    return counts;
}

/// The first so many steps but the last; instead of it later ones of other clusters, until the squared error
/// has grown by no more than error_left. With the last step, where that takes fewer bits.
ComponentCounts OrlpcaEncoder::without_last(std::int64_t steps, double error_left) const {
    const auto last = static_cast<std::size_t>(steps - 1);
    ComponentCounts counts = counts_after(steps - 1);
    double excess = steps_[last].distortion - error_left, bits = 0.0;
    for (std::size_t k = last + 1; k < steps_.size() && excess > 0.0; ++k) {
        if (steps_[k].source == steps_[last].source) continue;
        counts[static_cast<std::size_t>(steps_[k].source)] = steps_[k].point;
        excess -= steps_[k].distortion;
        bits += bits_of(k);
    }
    return excess > 0.0 || bits >= bits_of(last) ? counts_after(steps) : counts;
}

/// The bitstream with so many components. Only clusters whose number changed are quantised anew.
Expected<Bytes> OrlpcaEncoder::write(const ComponentCounts& counts) {
    const RlpcaHeader& header = source_.header();
    const auto done = for_each_cluster(header.cluster_count, executor_, [&](std::size_t i) -> Expected<void> {
        if (counts_[i] == counts[i]) return {};
        auto coded =
            quantize_cluster(source_.local_coordinates(i), components_[i].leftCols(counts[i]), header);
        if (!coded) return tl::unexpected(coded.error());
        coded_[i] = std::move(*coded);
        counts_[i] = counts[i];
        return {};
    });
    if (!done) return tl::unexpected(done.error());
    std::int64_t most = 1;
    for (const CodedCluster& cluster : coded_) most = std::max(most, cluster.component_count);
    return source_.write(CodecMethod::kOrlpca, static_cast<std::int32_t>(most), coded_, executor_);
}

/// What a decoder makes of a bitstream, against the source.
Expected<ErrorMetrics> OrlpcaEncoder::measure(const Bytes& bitstream) const {
    constexpr std::int64_t kNoLimit = std::numeric_limits<std::int64_t>::max();  // these bytes are our own
    constexpr std::int64_t kBlockFrames = 64;
    const auto parsed = parse_clip_bitstream(bitstream);
    if (!parsed) return tl::unexpected(parsed.error());
    const auto clip = decode_rlpca(*parsed, mesh_, -1, kNoLimit, executor_);
    if (!clip) return tl::unexpected(clip.error());
    ErrorMeter meter(positions_.vertex_count());
    std::vector<float> decoded;
    for (std::int64_t first = 0; first < positions_.frame_count(); first += kBlockFrames) {
        const std::int64_t end = std::min(first + kBlockFrames, positions_.frame_count());
        const PositionsView source = positions_.frames(first, end);
        decoded.resize(static_cast<std::size_t>(source.value_count()));
        const MutablePositionsView block(decoded.data(), end - first, positions_.vertex_count());
        if (auto done = (*clip)->reconstruct(first, block, executor_); !done)
            return tl::unexpected(done.error());
        meter.add(source, block, executor_);
    }
    return meter.finish();
}

/// The bitstream of most components that has at most so many bits a vertex and frame.
Expected<Bytes> OrlpcaEncoder::encode_to_size(double target) {
    double fixed = 0.0;
    Bytes best;
    const auto place = last_within(
        static_cast<std::int64_t>(bits_after_.size()), target,
        [&](std::int64_t k) { return bits_after_[static_cast<std::size_t>(k)] / sample_count() + fixed; },
        [&](std::int64_t k) -> Expected<double> {
            auto bitstream = write(counts_after(k));
            if (!bitstream) return tl::unexpected(bitstream.error());
            const double rate = 8.0 * static_cast<double>(bitstream->size()) / sample_count();
            if (k == 0) fixed = rate;
            if (rate <= target) best = std::move(*bitstream);  // it is larger than the ones before
            return rate;
        });
    if (!place) return tl::unexpected(place.error());
    if (*place < 0)
        return fail(ErrorCode::kInvalidArgument,
                    "codec.target.bpvf is beyond reach: without any component the clip takes " +
                        shown(fixed) + ", and " + shown(target) +
                        " are left for it; fewer clusters or frame_bits take less");
    // A large step that does not fit may leave much.
    const double left = kTrust * (target * sample_count() - 8.0 * static_cast<double>(best.size()));
    const ComponentCounts counts = filled_up(*place, left);
    if (counts == counts_after(*place)) return best;
    auto filled = write(counts);
    if (!filled) return filled;
    return 8.0 * static_cast<double>(filled->size()) / sample_count() <= target ? filled : best;
}

/// The bitstream of fewest components whose error is at most so many percent.
Expected<Bytes> OrlpcaEncoder::encode_to_error(CodecTarget which, double target) {
    const std::string name = "codec.target." + std::string(to_name(which));
    const auto step_count = static_cast<std::int64_t>(steps_.size());
    double seeds = 0.0;  // squared error of the vertices of seed triangles, and what else no step changes
    double least = 0.0, best_error = 0.0;
    Bytes best;
    const auto percent_of = [&](const ErrorMetrics& metrics) {
        return which == CodecTarget::kDa ? metrics.da : metrics.kg;
    };
    // Place j leaves out the last j steps, so that errors do not decrease.
    const auto squared = [&](std::int64_t j) {
        return std::max(0.0, error_after_[static_cast<std::size_t>(step_count - j)] + seeds);
    };
    const auto place = last_within(
        step_count + 1, target, [&](std::int64_t j) { return std::sqrt(squared(j)); },
        [&](std::int64_t j) -> Expected<double> {
            auto bitstream = write(counts_after(step_count - j));
            if (!bitstream) return tl::unexpected(bitstream.error());
            const auto metrics = measure(*bitstream);
            if (!metrics) return tl::unexpected(metrics.error());
            const double error = percent_of(*metrics);
            if (std::isnan(error))
                return fail(ErrorCode::kInvalidArgument,
                            name + ": this clip has none, since " +
                                (which == CodecTarget::kDa ? "nothing in it moves"
                                                           : "its vertices are in one place") +
                                "; take another target");
            if (j == 0) {
                least = error;
                seeds = metrics->rmse * metrics->rmse * sample_count() - error_after_.back();
            }
            if (error <= target) {  // it is smaller than the ones before
                best = std::move(*bitstream);
                best_error = error;
            }
            return error;
        });
    if (!place) return tl::unexpected(place.error());
    if (*place < 0)
        return fail(ErrorCode::kInvalidArgument,
                    name + " of " + shown(target) + " is beyond reach: " + shown(least) +
                        " is left with codec.components " + std::to_string(parameters_.components) +
                        "; raise it, or basis_bits, coefficient_bits or frame_bits");
    // A large last step may have brought much more than was missing.
    const std::int64_t steps = step_count - *place;
    if (steps == 0 || !(best_error > 0.0)) return best;
    const double slack = std::pow(target / best_error, 2.0) - 1.0;
    const ComponentCounts counts = without_last(steps, kTrust * slack * squared(*place));
    if (counts == counts_after(steps)) return best;
    auto smaller = write(counts);
    if (!smaller) return smaller;
    const auto metrics = measure(*smaller);
    if (!metrics) return tl::unexpected(metrics.error());
    return percent_of(*metrics) <= target && smaller->size() < best.size() ? smaller : best;
}

Expected<Bytes> OrlpcaEncoder::encode() {
    for (const CodecTarget target : {CodecTarget::kDa, CodecTarget::kKg}) {
        if (const double value = value_of(parameters_, target); value > 0.0)
            return encode_to_error(target, value);
    }
    if (parameters_.target_bpvf > 0.0) return encode_to_size(parameters_.target_bpvf);
    return write(counts_within(parameters_.target_components));
}

}  // namespace

Expected<EncodedClip> encode_orlpca(PositionsView positions, const MeshTopology& mesh,
                                    const Segmentation& segmentation, const CodecParameters& parameters,
                                    const Executor& executor) {
    const auto source = RlpcaSource::of(positions, mesh, segmentation, parameters, executor);
    if (!source) return tl::unexpected(source.error());
    OrlpcaEncoder encoder(positions, mesh, parameters, *source, executor);
    if (auto done = encoder.analyse(); !done) return tl::unexpected(done.error());
    auto bitstream = encoder.encode();
    if (!bitstream) return tl::unexpected(bitstream.error());
    EncodedClip clip;
    clip.bitstream = std::move(*bitstream);
    return clip;
}

}  // namespace batchenc
