#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/executor.h"
#include "core/mesh_sequence.h"
#include "kernels/vertex_triangles.h"

namespace batchenc {

/// The triangle that carries a seed's LCF, and whether it had to be looked for beyond the seed's own
/// triangles.
struct SeedTriangle {
    Triangle vertices{};
    bool replaced = false;  ///< every triangle at the seed collapses in some frame, or the seed has none
    bool degenerate =
        false;  ///< no triangle is usable in every frame; the LCF keeps its rotation while there is no area
};

/// Finds the seed triangles of one clip; what all seeds need is found once.
class SeedTriangleChooser {
 public:
    /// positions: F × V. triangles, vertex_triangles: of the mesh, triangles may be empty (points). All are
    /// referred to, and outlive the object. e_max: largest side of the bounding box, world units.
    SeedTriangleChooser(PositionsView positions, std::span<const Triangle> triangles,
                        const VertexTriangles& vertex_triangles, double e_max);

    /// Of the seed's incident triangles the one whose smallest area over time is largest; where all of them
    /// collapse in some frame, the usable triangle nearest to the seed in the first frame. Without
    /// triangles: the seed and its two neighbours (among the 16 nearest vertices of the first frame) whose
    /// triangle has the largest smallest area. With fewer than three vertices an index is repeated. A
    /// triangle is usable when its area stays above 1e-10 of e_max squared.
    ///
    /// seed: vertex index. executor: gets the search over all triangles, where one is needed.
    SeedTriangle choose(std::int32_t seed, const Executor& executor);

    /// A quick look at another vertex: of its incident triangles the one that is largest in the first frame,
    /// if it is usable. Any thread.
    std::optional<Triangle> incident_triangle(std::int32_t vertex) const;

 private:
    PositionsView positions_;
    std::span<const Triangle> triangles_;
    const VertexTriangles& vertex_triangles_;
    double usable_;                                    // squared doubled area
    std::optional<std::vector<Triangle>> all_usable_;  // once a seed needs them
};

}  // namespace batchenc
