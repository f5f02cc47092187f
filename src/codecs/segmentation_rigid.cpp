#include <algorithm>
#include <array>
#include <limits>
#include <numeric>

#include "codecs/segmentation_methods.h"
#include "kernels/rigid_motion.h"
#include "kernels/variation.h"

namespace batchenc {
namespace {

constexpr int kMostRounds = 10;      // of Lloyd's iteration; the cost falls little after the first few
constexpr double kLeastGain = 1e-3;  // part of the cost that a round must take off to be followed by another
constexpr std::size_t kCorners = 8;  // vertices far apart, of which triples are tried as seed triangles
constexpr std::size_t kSteadyCorners = 5;  // of these the first, taken from the steadier half
constexpr std::size_t kWitnesses = 64;     // vertices of a cluster that judge a triple

using Members = std::vector<std::vector<std::int32_t>>;

/// Vertices of each cluster, ascending; clusters of too few are left out, if any other remains.
Members members_of(std::span<const std::int32_t> labels, std::int32_t cluster_count) {
    Members members(static_cast<std::size_t>(cluster_count));
    for (std::size_t v = 0; v < labels.size(); ++v)
        members[static_cast<std::size_t>(labels[v])].push_back(static_cast<std::int32_t>(v));
    Members large;
    for (auto& cluster : members) {
        if (cluster.size() > std::size_t{kFewVertices}) large.push_back(std::move(cluster));
    }
    if (!large.empty()) return large;
    std::vector<std::int32_t> all(labels.size());
    std::iota(all.begin(), all.end(), 0);
    return {all};
}

/// Lloyd's iteration: motions for members, then members for motions.
class Refinement {
 public:
    Refinement(const SegmentationInput& input, const VertexBlocks& blocks)
        : input_(input),
          blocks_(blocks),
          labels_(static_cast<std::size_t>(blocks.vertex_count())),
          variations_(labels_.size()),
          rest_(input.positions.data(), input.positions.data() + 3 * blocks.vertex_count()) {}

    Members run(const Segmentation& start) {
        Members members = members_of(start.labels, start.cluster_count());
        double cost = std::numeric_limits<double>::infinity();
        for (int round = 1;; ++round) {  // ends: rounds beyond kMostRounds each leave fewer clusters
            move(members);
            assign();
            members = members_of(labels_, static_cast<std::int32_t>(tracks_.size()));
            if (members.size() < tracks_.size()) continue;  // vertices without a cluster look for another
            const double before = cost;
            cost = std::accumulate(variations_.begin(), variations_.end(), 0.0);
            if (round >= kMostRounds || !(cost < before * (1.0 - kLeastGain))) return members;
        }
    }

    /// Places in the frames of each vertex' cluster, mean over time: 3 × V.
    const std::vector<float>& rest() const { return rest_; }
    /// Variation of each vertex in its cluster.
    const std::vector<float>& variations() const { return variations_; }

 private:
    void move(const Members& members) {
        tracks_.assign(members.size(), LocalFrameTrack(0));
        input_.executor.for_each(static_cast<std::int64_t>(members.size()), [&](std::int64_t i) {
            const auto at = static_cast<std::size_t>(i);
            tracks_[at] = rigid_motion(input_.positions, members[at], rest_);
        });
    }

    void assign() {
        input_.executor.for_each(blocks_.count(), [&](std::int64_t index) {
            thread_local std::vector<float> rows;
            rows.resize(tracks_.size() * kVariationRows * kVertexBlock);
            variation_block(blocks_.block(index), blocks_.frame_count(), tracks_, rows);
            const std::int64_t first = index * kVertexBlock;
            for (std::int64_t v = first; v < std::min(first + kVertexBlock, blocks_.vertex_count()); ++v) {
                const auto value = [&](std::size_t i, std::int64_t row) {
                    return rows[(i * kVariationRows + static_cast<std::size_t>(row)) * kVertexBlock +
                                static_cast<std::size_t>(v - first)];
                };
                std::size_t best = 0;
                for (std::size_t i = 1; i < tracks_.size(); ++i) {
                    if (value(i, kVariation) < value(best, kVariation)) best = i;
                }
                const auto at = static_cast<std::size_t>(v);
                labels_[at] = static_cast<std::int32_t>(best);
                variations_[at] = bounded_deviation(value(best, kVariation));
                for (std::int64_t axis = 0; axis < 3; ++axis)
                    rest_[3 * at + static_cast<std::size_t>(axis)] = value(best, kMeanX + axis);
            }
        });
    }

    const SegmentationInput& input_;
    const VertexBlocks& blocks_;
    std::vector<LocalFrameTrack> tracks_;
    std::vector<std::int32_t> labels_;  // V
    std::vector<float> variations_;     // V
    std::vector<float> rest_;           // 3 × V
};

/// Vertices of a cluster far apart at rest: some of the steadier half, then some of all, because the steady
/// ones may lie on a line.
std::vector<std::int32_t> corners_of(const Refinement& refinement, std::vector<std::int32_t> members) {
    std::stable_sort(members.begin(), members.end(), [&](std::int32_t a, std::int32_t b) {
        return refinement.variations()[static_cast<std::size_t>(a)] <
               refinement.variations()[static_cast<std::size_t>(b)];
    });
    const auto place = [&](std::int32_t v) {
        return refinement.rest().data() + 3 * static_cast<std::ptrdiff_t>(v);
    };
    std::vector<std::int32_t> corners = {members[0]};
    std::vector<double> distance(members.size(), std::numeric_limits<double>::infinity());
    const auto steady = static_cast<std::ptrdiff_t>((members.size() + 1) / 2);
    while (corners.size() < std::min(kCorners, members.size())) {
        for (std::size_t k = 0; k < members.size(); ++k)
            distance[k] = std::min(distance[k], squared_distance(place(members[k]), place(corners.back())));
        const bool from_steady = corners.size() < kSteadyCorners;
        const auto farthest =
            std::max_element(distance.begin(), from_steady ? distance.begin() + steady : distance.end());
        if (!(*farthest > 0.0)) break;
        corners.push_back(members[static_cast<std::size_t>(farthest - distance.begin())]);
    }
    return corners;
}

/// The triple of a cluster's vertices in whose LCF the cluster varies least.
Triangle carrying_triple(const SegmentationInput& input, const Refinement& refinement,
                         const std::vector<std::int32_t>& members) {
    const std::vector<std::int32_t> corners = corners_of(refinement, members);
    const auto corner = [&](std::size_t k) { return corners[std::min(k, corners.size() - 1)]; };
    if (corners.size() <= 3) return {corner(0), corner(1), corner(2)};
    std::vector<Triangle> triples;
    std::vector<LocalFrameTrack> tracks;
    for (std::size_t a = 0; a < corners.size(); ++a) {
        for (std::size_t b = a + 1; b < corners.size(); ++b) {
            for (std::size_t c = b + 1; c < corners.size(); ++c) {
                triples.push_back({corners[a], corners[b], corners[c]});
                tracks.push_back(triangle_track(input.positions, triples.back()));
            }
        }
    }
    const std::int64_t frame_count = input.positions.frame_count();
    const std::vector<std::int32_t> witnesses = spread_sample(members, kWitnesses);
    std::vector<double> costs(triples.size(), 0.0);
    AlignedFloats block(vertex_block_size(frame_count));
    std::vector<float> rows(triples.size() * kVariationRows * kVertexBlock);
    for (std::size_t first = 0; first < witnesses.size(); first += kVertexBlock) {
        const std::size_t count = std::min<std::size_t>(kVertexBlock, witnesses.size() - first);
        gather_vertex_block(input.positions, std::span(witnesses).subspan(first, count), block.data());
        variation_block(block.data(), frame_count, tracks, rows);
        for (std::size_t k = 0; k < triples.size(); ++k) {
            const float* variation = rows.data() + k * kVariationRows * kVertexBlock;
            for (std::size_t v = 0; v < count; ++v) costs[k] += static_cast<double>(variation[v]);
        }
    }
    return triples[static_cast<std::size_t>(std::min_element(costs.begin(), costs.end()) - costs.begin())];
}

}  // namespace

Segmentation refine_rigidly(const SegmentationInput& input, const VertexBlocks& blocks,
                            const Segmentation& start) {
    Refinement refinement(input, blocks);
    const Members members = refinement.run(start);
    Segmentation segmentation;
    segmentation.labels.resize(start.labels.size());
    segmentation.seed_triangles.resize(members.size());
    input.executor.for_each(static_cast<std::int64_t>(members.size()), [&](std::int64_t i) {
        const auto at = static_cast<std::size_t>(i);
        for (const std::int32_t v : members[at])
            segmentation.labels[static_cast<std::size_t>(v)] = static_cast<std::int32_t>(i);
        segmentation.seed_triangles[at] = carrying_triple(input, refinement, members[at]);
    });
    measure_deviations(input, &blocks, segmentation);
    return segmentation;
}

}  // namespace batchenc
