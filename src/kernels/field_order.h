#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "kernels/mesh_traversal.h"

namespace batchenc {

class MeshTopology;

/// The vertices of one cluster in the order in which fields over them are coded, and from what each value may
/// be predicted: parallelograms and neighbours inside the cluster that come before it. A function of what
/// encoder and decoder both know.
struct FieldOrder {
    static constexpr std::size_t kMostNeighbours = 8;

    std::vector<std::int32_t> vertices;  ///< n vertex indices
    std::vector<std::int32_t> first_gate = {
        0};  ///< n + 1 values: gates of place k are gates[first_gate[k]] …
    std::vector<std::array<std::int32_t, 3>> gates;  ///< places left, right, opposite: v ~ left + right -
                                                     ///< opposite; at most MeshTraversal::kMostGates a vertex
    std::vector<std::int32_t> first_neighbour = {0};  ///< n + 1 values, likewise
    std::vector<std::int32_t> neighbours;  ///< places of neighbours, ascending, of points descending; at most
                                           ///< kMostNeighbours a vertex

    std::int64_t size() const { return static_cast<std::int64_t>(vertices.size()); }

    /// Of every cluster, in the order of the mesh's traversal. labels: V values, 0 … cluster_count - 1.
    static std::vector<FieldOrder> of(const MeshTopology& mesh, std::span<const std::int32_t> labels,
                                      std::int32_t cluster_count);
    /// Of all vertices of a mesh or of points as one cluster; points stand as the file has them. MeshTopology
    /// keeps it.
    static FieldOrder of_whole(const MeshTopology& mesh);
    /// Of points: along a Hilbert curve, each the neighbour of the next two. points: 3 × V.
    static std::vector<FieldOrder> along_curve(std::span<const float> points,
                                               std::span<const std::int32_t> labels,
                                               std::int32_t cluster_count);
};

}  // namespace batchenc
