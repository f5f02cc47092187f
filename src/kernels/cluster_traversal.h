#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/mesh_sequence.h"

namespace batchenc {

/// Neighbours of every vertex over triangle edges, as compressed rows: those of v are
/// neighbours[first[v]] … neighbours[first[v + 1] - 1]. Each triangle (a, b, c) gives a the neighbour b, b
/// the neighbour c and c the neighbour a, so that an edge between two consistently wound triangles appears
/// once in each direction.
struct MeshAdjacency {
    std::vector<std::int32_t> first;       ///< V + 1 values
    std::vector<std::int32_t> neighbours;  ///< 3 T values

    /// triangles: every index in [0, vertex_count), T below 2^31 / 3.
    static MeshAdjacency of(std::span<const Triangle> triangles, std::int64_t vertex_count);
};

/// The vertices of one cluster in an order that encoder and decoder derive from connectivity alone: breadth
/// first over mesh edges inside the cluster, components one after another from their lowest index. Each
/// vertex knows up to kMaxPredecessors neighbours that come before it, from which values over the mesh are
/// predicted.
struct ClusterTraversal {
    static constexpr int kMaxPredecessors = 4;

    std::vector<std::int32_t> vertices;      ///< n vertex indices
    std::vector<std::int32_t> predecessors;  ///< n × kMaxPredecessors positions in `vertices`, missing ones n
    std::vector<std::uint8_t> predecessor_count;  ///< n values

    std::int64_t size() const { return static_cast<std::int64_t>(vertices.size()); }
};

/// Orders one cluster. members: its vertices, ascending. owner: V values, the cluster of each vertex;
/// neighbours of another owner are not visited. position: V values, -1 for every member when called, their
/// place in the order afterwards; clusters of one mesh may share the array, each touches the entries of its
/// members only.
ClusterTraversal traverse_cluster(const MeshAdjacency& adjacency, std::span<const std::int32_t> members,
                                  std::span<const std::int32_t> owner, std::int32_t cluster,
                                  std::span<std::int32_t> position);

}  // namespace batchenc
