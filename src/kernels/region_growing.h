#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/executor.h"
#include "core/mesh_sequence.h"
#include "kernels/vertex_triangles.h"

namespace batchenc {

/// The mean over time of every vertex' position, 3 × V, world units.
std::vector<float> mean_positions(PositionsView positions, const Executor& executor);

/// Grows regions over a mesh from seed triangles (4.4.3). Each region has a queue of the edges at its border,
/// ordered by the distance of the candidate vertex, the third corner of the triangle beyond the edge, from
/// the region's seed; of equal distances the lower vertex comes first. Regions take turns; in its turn a
/// region takes one vertex. What no region reaches (other components of the mesh, points) goes, a component
/// as a whole, to the region whose seed is nearest to the component's centre; of two the first.
///
/// positions: 3 × V, the mean over time. seeds: N vertex indices, N at least 1. seed_triangles: N triples of
/// vertex indices, where the regions begin; of two that share a vertex the first has it. Returns the region
/// of every vertex, 0 … N-1.
std::vector<std::int32_t> grow_regions(std::span<const float> positions, std::span<const Triangle> triangles,
                                       const VertexTriangles& vertex_triangles,
                                       std::span<const std::int32_t> seeds,
                                       std::span<const Triangle> seed_triangles);

}  // namespace batchenc
