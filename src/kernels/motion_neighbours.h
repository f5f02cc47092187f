#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/executor.h"
#include "kernels/mesh_topology.h"

namespace batchenc {

/// The order in which MotionFit takes the vertices of a frame, and from which vertices each is predicted.
///
/// Order: a coarse part first, in the order of the mesh's traversal (of points: a Hilbert curve's), then
/// levels of independent vertices, each of them finer: interpolating between neighbours on all sides beats
/// extrapolating. A vertex of a level is predicted from lower levels alone, so that a level can be done at
/// once. Weights to begin with are those of ordinary kriging of a smooth field over the first frame (G.
/// Matheron, "Principles of geostatistics", 1963).
struct MotionNeighbours {
    static constexpr std::size_t kCount = 8;
    static constexpr int kLevels = 6;  ///< finer than the coarse part

    std::vector<std::int32_t> order;  ///< V: vertex of each place
    std::vector<std::int32_t>
        level_first;                   ///< kLevels + 2: first place of the coarse part, of every level; V
    std::vector<std::int32_t> places;  ///< V × kCount, each an earlier place; V for none
    std::vector<float> weights;        ///< V × kCount, sums to one; 0 for none

    /// first_frame: V × 3, finite, as the decoder has it. The same on every machine and for every executor.
    static MotionNeighbours of(const MeshTopology& mesh, std::span<const float> first_frame,
                               const Executor& executor);
};

}  // namespace batchenc
