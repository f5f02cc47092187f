#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "codecs/integer_contexts.h"
#include "core/error.h"
#include "core/executor.h"
#include "core/parameters.h"
#include "kernels/cluster_traversal.h"
#include "kernels/local_frame.h"

namespace batchenc {

// What encoder and decoder of RLPCA derive alike from parameters, labels, seed triangles and connectivity.

/// The content of the parameters section.
struct RlpcaHeader {
    CoordinateSpace space = CoordinateSpace::kLocal;
    std::int32_t basis_bits = 0;
    std::int32_t coefficient_bits = 0;
    std::int32_t frame_bits = 0;
    std::int32_t components = 0;     ///< asked for; clusters of lower rank have fewer
    std::int32_t cluster_count = 0;  ///< N
    std::array<float, 3>
        center{};  ///< of the bounding box over all frames, world units; origin of lattice and world space
    float e_max = 0.0f;  ///< largest side of that box

    /// Spacing of the lattice of the seed triangles, world units; the lattice has a point at the centre.
    double lattice_step() const {
        return static_cast<double>(e_max) / static_cast<double>(std::int64_t{1} << frame_bits);
    }

    /// The track of world space: axes of the world, origin at the centre, so that offsets cost the components
    /// nothing.
    LocalFrameTrack world_track(std::int64_t frame_count) const;

    std::vector<std::uint8_t> write() const;
    /// Error: kCorrupt.
    static Expected<RlpcaHeader> read(std::span<const std::uint8_t> payload, std::int64_t vertex_count);
};

/// Which vertices each cluster's matrix holds, and in which order.
struct RlpcaLayout {
    std::vector<std::int32_t>
        owner;  ///< V values: cluster whose matrix holds the vertex; -1 for seed vertices in local space
    std::vector<ClusterTraversal> clusters;  ///< N

    /// seed_triangles: N, or none in world space. adjacency: of the whole mesh.
    RlpcaLayout(std::span<const std::int32_t> labels, std::span<const Triangle> seed_triangles,
                std::int32_t cluster_count, const MeshAdjacency& adjacency, const Executor& executor);
};

/// Deals clusters to coded streams: about one stream for every 65,536 values, so that streams can be coded at
/// once and each is long enough to learn from; large clusters first, each to the stream that has least.
/// Depends on the sizes alone.
std::vector<std::vector<std::int32_t>> deal_streams(std::span<const std::int64_t> values_of_cluster);

/// Seed triangles of one cluster over time on the lattice: nine series of F values, p1 and the edges p2 - p1,
/// p3 - p1.
struct SeedTrianglePath {
    std::array<std::vector<std::int32_t>, 9> series;

    /// World position of corner 0, 1 or 2 in a frame.
    std::array<double, 3> corner(std::size_t corner, std::int64_t frame, const RlpcaHeader& header) const;
    /// LCFs of all frames; corners are taken on the lattice, where a triangle without area is exactly that.
    LocalFrameTrack track(const RlpcaHeader& header) const;
};

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

}  // namespace batchenc
