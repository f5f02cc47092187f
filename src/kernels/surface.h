#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/mesh_sequence.h"

namespace batchenc {

/// Triangles glued to an oriented surface with boundary, in which every corner has a *fan*: the triangles at
/// its vertex that are reached one from another over glued edges. Where a mesh is no such surface, it is cut:
/// an edge of three triangles is glued for two of them, a vertex whose triangles do not hang together has
/// several fans, a triangle with two equal corners is glued to nothing.
///
/// Half-edge 3t + k runs from corner k of triangle t to corner k + 1 (of 3), after flipping.
struct Surface {
    std::vector<Triangle> triangles;       ///< T; flipped ones with their last two corners exchanged
    std::vector<std::uint8_t> is_flipped;  ///< T: the winding is the other one than its neighbours' ask for
    std::vector<std::int32_t> twin;  ///< 3T: the half-edge it is glued to, which runs the other way; -1: none
    std::vector<std::int32_t> fan;   ///< 3T: fan of the corner where the half-edge begins
    std::vector<std::int32_t> fan_size;     ///< triangles of each fan
    std::vector<std::uint8_t> fan_is_open;  ///< of each fan: it ends at the boundary (or a cut)

    /// triangles: T below 2^31 / 3, any indices >= 0. Linear in time and memory.
    static Surface of(std::span<const Triangle> triangles);

    static std::int32_t next(std::int32_t half_edge) {
        return half_edge % 3 == 2 ? half_edge - 2 : half_edge + 1;
    }
    static std::int32_t previous(std::int32_t half_edge) {
        return half_edge % 3 == 0 ? half_edge + 2 : half_edge - 1;
    }
    /// Vertex where a half-edge begins.
    std::int32_t start(std::int32_t half_edge) const {
        return triangles[static_cast<std::size_t>(half_edge / 3)][static_cast<std::size_t>(half_edge % 3)];
    }
};

}  // namespace batchenc
