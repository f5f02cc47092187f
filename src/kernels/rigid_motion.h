#pragma once

#include <cstdint>
#include <span>

#include "core/mesh_sequence.h"
#include "kernels/local_frame.h"

namespace batchenc {

/// The rigid motion of some vertices: for every frame the rotation T and the origin o (their centroid) for
/// which sum over k of | T (p_k - o) - (r_k - mean of r) |^2 is smallest (W. Kabsch, "A solution for the best
/// rotation to relate two sets of vectors", 1976). Where the vertices leave the rotation open (one point, a
/// line), it is the one nearest to the frame before. The sums over vertices are one matrix product.
///
/// positions: F × V. members: at least one vertex. rest: 3 × V, the places r that the vertices should come
/// back to, such as their positions in one frame or their mean local coordinates; those of members count.
LocalFrameTrack rigid_motion(PositionsView positions, std::span<const std::int32_t> members,
                             std::span<const float> rest);

}  // namespace batchenc
