#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "codecs/rlpca_clusters.h"
#include "codecs/rlpca_layout.h"
#include "core/error.h"
#include "core/executor.h"
#include "core/mesh_sequence.h"
#include "kernels/cluster_traversal.h"
#include "kernels/reconstruction.h"

namespace batchenc {

/// Clusters as coders by principal components decode them: for each a basis and its coefficients, from the
/// sections that RlpcaSource writes.
class ComponentClusters {
 public:
    ComponentClusters() = default;
    /// header: of cluster_count, components and bits. given: components at the front of each cluster that do
    /// not stand in the sections and that the caller sets.
    ComponentClusters(std::vector<ClusterTraversal> clusters, std::int64_t frame_count,
                      const RlpcaHeader& header, std::int64_t given = 0)
        : clusters_(std::move(clusters)), header_(header), frame_count_(frame_count), given_(given) {}

    /// Reads the basis first, of each cluster at most `components`, all where it is negative, and then the
    /// coefficients. Errors: kCorrupt, kLimit.
    Expected<void> read_basis(std::span<const std::uint8_t> payload, std::int32_t components,
                              std::int64_t size_limit_bytes, const Executor& executor);
    Expected<void> read_coefficients(std::span<const std::uint8_t> payload, const SeriesForm& form,
                                     std::int64_t size_limit_bytes, const Executor& executor);
    /// Sets a given component of a cluster, after both are read. basis: 3n values in the traversal's order.
    /// Its coefficients are 1 in every frame.
    void set_given(std::size_t cluster, std::int64_t component, std::span<const float> basis);

    std::size_t size() const { return clusters_.size(); }
    const ClusterTraversal& traversal(std::size_t cluster) const { return clusters_[cluster]; }
    /// Reconstructs frames of one cluster; see reconstruct_cluster. track: of this cluster, F frames.
    void reconstruct(std::size_t cluster, const LocalFrameTrack& track, std::int64_t begin,
                     MutablePositionsView out) const;

 private:
    std::int64_t stride() const { return (frame_count_ + 15) / 16 * 16; }

    std::vector<ClusterTraversal> clusters_;
    RlpcaHeader header_;
    std::int64_t frame_count_ = 0;
    std::int64_t given_ = 0;
    std::vector<std::int64_t> coded_components_;  // in the stream
    std::vector<std::int64_t> used_components_;   // decoded of them
    std::vector<PackedBasis> bases_;
    std::vector<std::vector<float>> coefficients_;  // rows of stride() floats
};

/// Serves any range of frames by a function that makes blocks of up to kFrameLanes frames, each from a
/// multiple of kFrameLanes on: make_block(begin, out). vertex_count: of out.
template <typename MakeBlock>
void reconstruct_in_blocks(std::int64_t begin, MutablePositionsView out, const Executor& executor,
                           MakeBlock make_block) {
    const std::int64_t end = begin + out.frame_count();
    // A range that does not begin with a block is served through its first whole block.
    const std::int64_t first_block = begin / kFrameLanes;
    const std::int64_t last_block = (end + kFrameLanes - 1) / kFrameLanes;
    const std::int64_t values = 3 * out.vertex_count();
    executor.for_each(out.frame_count() == 0 ? 0 : last_block - first_block, [&](std::int64_t index) {
        const std::int64_t block = (first_block + index) * kFrameLanes;
        const std::int64_t count = std::min(kFrameLanes, end - block);
        if (block >= begin) {
            make_block(block, MutablePositionsView(out.at(block - begin, 0), count, out.vertex_count()));
            return;
        }
        std::vector<float> whole(static_cast<std::size_t>(count * values));
        make_block(block, MutablePositionsView(whole.data(), count, out.vertex_count()));
        std::copy(whole.begin() + (begin - block) * values, whole.end(), out.data());
    });
}

}  // namespace batchenc
