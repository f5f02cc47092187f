#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/executor.h"
#include "core/mesh_sequence.h"

namespace batchenc {

/// Farthest-point seeds (4.4.2): first the vertex farthest from the centroid of the frame, then again and
/// again the vertex farthest from all seeds so far; ties go to the lower index.
///
/// frame: one frame, 3 × V, V at least 1. count: wanted seeds, at least 1. Returns min(count, number of
/// distinct positions) vertex indices, all different.
std::vector<std::int32_t> farthest_point_seeds(PositionsView frame, std::int32_t count);

/// The triangle that carries a seed's LCF, and whether it had to be looked for beyond the seed's own
/// triangles.
struct SeedTriangle {
    Triangle vertices;
    bool replaced = false;  ///< every triangle at the seed collapses in some frame, or the seed has none
    bool degenerate =
        false;  ///< no triangle is usable in every frame; the LCF keeps its rotation while there is no area
};

/// For each seed the incident triangle whose smallest area over time is largest; where all of them collapse
/// in some frame, the usable triangle nearest to the seed in the first frame. Without triangles: the seed and
/// its two neighbours (among the 16 nearest vertices of the first frame) whose triangle has the largest
/// smallest area. With fewer than three vertices an index is repeated. A triangle is usable when its area
/// stays above 1e-10 of the squared largest side of the bounding box.
///
/// positions: F × V. triangles: may be empty. seeds: vertex indices.
std::vector<SeedTriangle> choose_seed_triangles(PositionsView positions, std::span<const Triangle> triangles,
                                                std::span<const std::int32_t> seeds,
                                                const Executor& executor);

}  // namespace batchenc
