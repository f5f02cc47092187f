#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/mesh_sequence.h"

namespace batchenc {

/// A decoded triangle next to a vertex that is to be decoded: over the edge (left, right), which both share.
/// Corners are named by their places in the order, as all that is kept of decoded vertices is kept in it.
struct Gate {
    std::int32_t left = -1;
    std::int32_t right = -1;
    std::int32_t opposite = -1;  ///< third corner of the reference triangle; -1: the edge has none yet
    std::int32_t triangle = -1;  ///< number of the reference triangle; -1: none
};

/// The order in which geometry coders walk over a mesh, and from what they may predict each vertex; a
/// function of the triangles alone, so that encoder and decoder find it for themselves, once a mesh.
///
/// Region growing from gates (3.2): next comes the vertex that most triangles with two decoded corners share,
/// of equal ones the first that became so; where none is left, the next component starts with the triangle of
/// lowest number that has undecoded corners, and at last the vertices without triangles come by number.
/// (Breadth-first, but for vertices that can be predicted from several sides: cf. D. Cohen-Or, R. Cohen and
/// R. Irony, "Multi-way geometry encoding", 2002.)
struct MeshTraversal {
    static constexpr std::size_t kMostGates = 4;

    std::vector<std::int32_t> order;       ///< V vertex indices
    std::vector<std::int32_t> first_gate;  ///< V + 1 values: gates of order[k] are gates[first_gate[k]] …
                                           ///< before gates[first_gate[k + 1]], at most kMostGates
    std::vector<Gate> gates;               ///< those with a reference triangle; else at most one without
    std::vector<std::int32_t> anchor;  ///< V values: the place of a decoded vertex near order[k], for those
                                       ///< without gates; -1 for the very first

    /// triangles: T, any, every index in [0, vertex_count), T below 2^31 / 3. Linear in time and memory.
    static MeshTraversal of(std::span<const Triangle> triangles, std::int64_t vertex_count);

    /// The triangles with places for vertices.
    std::vector<Triangle> in_places(std::span<const Triangle> triangles) const;

    std::span<const Gate> gates_of(std::size_t place) const {
        return std::span(gates).subspan(static_cast<std::size_t>(first_gate[place]),
                                        static_cast<std::size_t>(first_gate[place + 1] - first_gate[place]));
    }
};

}  // namespace batchenc
