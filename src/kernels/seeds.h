#pragma once

#include <cstdint>
#include <vector>

#include "core/mesh_sequence.h"

namespace batchenc {

/// Farthest-point seeds (4.4.2): first the vertex farthest from the centroid of the frame, then again and
/// again the vertex farthest from all seeds so far; ties go to the lower index.
///
/// frame: one frame, 3 × V, V at least 1. count: wanted seeds, at least 1. Returns min(count, number of
/// distinct positions) vertex indices, all different.
std::vector<std::int32_t> farthest_point_seeds(PositionsView frame, std::int32_t count);

}  // namespace batchenc
