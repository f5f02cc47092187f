#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "codecs/seed_triangle_path.h"
#include "core/error.h"
#include "core/executor.h"
#include "core/parameters.h"
#include "kernels/cluster_traversal.h"

namespace batchenc {

// What encoder and decoder of RLPCA derive alike from parameters, labels, seed triangles and connectivity.

/// The content of the parameters section.
struct RlpcaHeader {
    CoordinateSpace space = CoordinateSpace::kLocal;
    std::int32_t basis_bits = 0;
    std::int32_t coefficient_bits = 0;
    std::int32_t components = 0;     ///< asked for; clusters of lower rank have fewer
    std::int32_t cluster_count = 0;  ///< N
    FrameLattice lattice;            ///< its centre is the origin of world space

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

}  // namespace batchenc
