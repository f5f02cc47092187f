#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/error.h"
#include "kernels/cluster_traversal.h"
#include "kernels/mesh_traversal.h"

namespace batchenc {

/// How the motions of clusters blend at their vertices: each vertex follows its own cluster and, by weights,
/// those that the mesh joins to it.
struct Skinning {
    static constexpr std::size_t kMostNeighbours = 7;
    static constexpr double kUnits = 256.0;  ///< of a whole weight
    using Weights = std::array<std::int32_t, kMostNeighbours>;

    /// For each cluster those joined to it by edges, by falling number of edges, of equal ones the lower
    /// first; kMostNeighbours at most. A function of labels and mesh, which a decoder has.
    std::vector<std::vector<std::int32_t>> neighbours;
    /// V: of the neighbours of the vertex' cluster, in units; its own cluster has what is left of one.
    std::vector<Weights> weights;

    /// All weights zero. labels: V values, 0 … cluster_count - 1.
    Skinning(std::span<const std::int32_t> labels, std::int32_t cluster_count,
             const MeshAdjacency& adjacency);

    /// Codes the weights in the traversal's order, each in a context by its place and by what stood there at
    /// the last vertex of the cluster.
    std::vector<std::uint8_t> write(std::span<const std::int32_t> labels,
                                    const MeshTraversal& traversal) const;
    /// The way back; no bytes where no cluster has a neighbour. Error: kCorrupt.
    Expected<void> read(std::span<const std::uint8_t> bytes, std::span<const std::int32_t> labels,
                        const MeshTraversal& traversal);

 private:
    template <typename Code>
    void code(std::span<const std::int32_t> labels, const MeshTraversal& traversal, Code code);
};

}  // namespace batchenc
