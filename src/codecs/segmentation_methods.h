#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "codecs/segmentation.h"
#include "kernels/seed_triangles.h"
#include "kernels/vertex_block.h"

namespace batchenc {

// The methods behind segment_clip, and what they share. Inside src/codecs only.

/// A clip about to be segmented. What it refers to outlives it.
struct SegmentationInput {
    PositionsView positions;              // F × V
    std::span<const Triangle> triangles;  // none for points
    const VertexTriangles& vertex_triangles;
    double e_max = 0.0;  // largest side of the bounding box, world units
    SeedTriangleChooser& seed_triangles;
    const Executor& executor;
};

/// What stands for a deviation or variation that float32 cannot hold.
inline constexpr float kLargestDeviation = std::numeric_limits<float>::max();
inline float bounded_deviation(float value) { return value <= kLargestDeviation ? value : kLargestDeviation; }

/// A cluster of so many vertices, three of which carry its LCF, is none.
inline constexpr std::int64_t kFewVertices = 4;

/// What is wrong with a seed triangle, in words for Segmentation::notes; empty when nothing is.
std::string seed_triangle_note(std::int32_t cluster, std::int32_t seed, const SeedTriangle& triangle);

/// Gives the corners of each seed triangle to its cluster (4.5.1); of two that share a vertex the first has
/// it.
void claim_seed_vertices(Segmentation& segmentation);

/// Sets Segmentation::deviations by the LCFs of the seed triangles, each vertex in its own cluster alone.
/// blocks: of the clip, where they are at hand.
void measure_deviations(const SegmentationInput& input, const VertexBlocks* blocks,
                        Segmentation& segmentation);

/// So many of the vertices, or all, evenly spread over the list.
std::vector<std::int32_t> spread_sample(const std::vector<std::int32_t>& vertices, std::size_t count);

/// Region growing (4.4) and clustering (4.5) from farthest-point seeds. count: at least 1.
Segmentation segment_by_region_growing(const SegmentationInput& input, std::int32_t count);
Segmentation segment_by_clustering(const SegmentationInput& input, std::int32_t count);

/// When adaptive clustering stops growing.
struct GrowthLimits {
    std::int32_t count = 0;           // clusters at most; 0: where the modelled bits stop falling
    double average_deviation = -1.0;  // stop at or below this; world units squared a frame, negative: never
};

/// Adaptive clustering (4.6): grows from a few clusters, each new one seeded by the worst vertex of the worst
/// cluster; a seed that gathers no more than a handful of vertices is passed over; then merges pairs that
/// improve, dissolves small clusters and grows again what that has freed.
///
/// blocks: of the clip. Automatic count: modelled bits are those of stepping every vertex from frame to frame
/// in its LCF and of carrying the seed triangles, both at e_max / 4096.
Segmentation segment_adaptively(const SegmentationInput& input, const VertexBlocks& blocks,
                                const GrowthLimits& limits);

/// Rigid-frame refinement: from the labels of `start`, Lloyd iterations of least-squares rigid motions and
/// reassignment of each vertex to the cluster in whose frames its place varies least. The seed triangle of
/// each cluster is the triple of its vertices, among some that lie far apart, whose LCF carries it best.
Segmentation refine_rigidly(const SegmentationInput& input, const VertexBlocks& blocks,
                            const Segmentation& start);

}  // namespace batchenc
