#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/error.h"
#include "core/mesh_sequence.h"
#include "kernels/cluster_traversal.h"

namespace batchenc {

// The section of labels and seed triangles of coders with clusters.

/// Codes labels in vertex order, each against the labels of neighbours that came before it; then the seed
/// triangles.
std::vector<std::uint8_t> write_segmentation(std::span<const std::int32_t> labels,
                                             std::span<const Triangle> seed_triangles,
                                             std::int32_t cluster_count, const MeshAdjacency& adjacency);

struct CodedSegmentation {
    std::vector<std::int32_t> labels;
    std::vector<Triangle> seed_triangles;
};
/// The way back. seed_triangle_count: N, or 0 in world space. Error: kCorrupt.
Expected<CodedSegmentation> read_segmentation(std::span<const std::uint8_t> payload,
                                              std::int64_t vertex_count, std::int32_t cluster_count,
                                              std::int32_t seed_triangle_count,
                                              const MeshAdjacency& adjacency);

/// Which vertices each cluster's signals hold: all but the corners of seed triangles, which have their own.
struct ClusterMembers {
    std::vector<std::int32_t> owner;                 ///< V values: cluster, or -1 for corners
    std::vector<std::vector<std::int32_t>> members;  ///< N lists of vertices, ascending

    /// seed_triangles: N, or none where there are no LCFs.
    ClusterMembers(std::span<const std::int32_t> labels, std::span<const Triangle> seed_triangles,
                   std::int32_t cluster_count);
};

}  // namespace batchenc
