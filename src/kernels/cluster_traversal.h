#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/matrix.h"
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

/// Magnitude of what predict_from_predecessors takes, at most.
inline constexpr std::int32_t kLargestPredictable = std::int32_t{1} << 21;

/// Prediction of a vertex' three integers from those of its predecessors: their mean, rounded to nearest by
/// float32 products and sums that have the same result on every machine; zeros without predecessors.
///
/// column: three values a vertex in the traversal's order, at most kLargestPredictable in magnitude, followed
/// by four zeros: missing predecessors point there. position: of the vertex in the order. predicted: four
/// integers, of which the last means nothing.
inline void predict_from_predecessors(const ClusterTraversal& traversal, const std::int32_t* column,
                                      std::size_t position, std::int32_t* predicted) {
    static_assert(ClusterTraversal::kMaxPredecessors == 4);
    constexpr float kShare[] = {0.0f, 1.0f, 0.5f, 1.0f / 3.0f, 0.25f};
    constexpr float kRounder =
        12582912.0f;  // 1.5 * 2^23: adding it leaves a float of small magnitude no fraction
    using Integers = Eigen::Array<std::int32_t, 4, 1>;
    const std::int32_t* places = traversal.predecessors.data() + position * 4;
    const auto of = [&](int k) {
        return Eigen::Map<const Integers>(column + 3 * static_cast<std::ptrdiff_t>(places[k]));
    };
    const Integers sum = (of(0) + of(1)) + (of(2) + of(3));
    const Eigen::Array4f rounded =
        (sum.cast<float>() * kShare[traversal.predecessor_count[position]] + kRounder) - kRounder;
    Eigen::Map<Integers>{predicted} = rounded.cast<std::int32_t>();
}

}  // namespace batchenc
