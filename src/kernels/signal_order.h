#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/mesh_sequence.h"
#include "kernels/cluster_traversal.h"

namespace batchenc {

// Orders of a cluster's vertices that make neighbours on the surface neighbours in a signal (7.3.5), from
// what a decoder knows anyway.

/// Orders one cluster as a walk over mesh edges inside it: on to the unvisited neighbour that has the fewest
/// unvisited neighbours itself, back along the way where there is none, so that borders are taken along and
/// nothing is left behind; components one after another from their lowest index. Predecessors are the
/// neighbours that come before a vertex. Arguments as of traverse_cluster. By integers alone.
ClusterTraversal walk_cluster(const MeshAdjacency& adjacency, std::span<const std::int32_t> members,
                              std::span<const std::int32_t> owner, std::int32_t cluster,
                              std::span<std::int32_t> position);

/// Places of points along a Hilbert curve of 2^16 cells a side over their bounding cube (D. Hilbert, 1891;
/// the bit form of J. Skilling, "Programming the Hilbert curve", 2004); points of one cell in their order.
/// points: 3 × n. Returns a permutation of 0 … n - 1, the identity where
/// points are one or not finite. The same on every machine.
std::vector<std::int32_t> curve_order(std::span<const float> points);

}  // namespace batchenc
