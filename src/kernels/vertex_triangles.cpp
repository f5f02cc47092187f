#include "kernels/vertex_triangles.h"

namespace batchenc {

VertexTriangles::VertexTriangles(std::span<const Triangle> triangles, std::int64_t vertex_count)
    : first_(static_cast<std::size_t>(vertex_count) + 2, 0), triangles_(3 * triangles.size()) {
    // Counted two places on, so that filling, which moves each start to the next one's, leaves them right.
    for (const Triangle& t : triangles) {
        for (const std::int32_t v : t) ++first_[static_cast<std::size_t>(v) + 2];
    }
    for (std::size_t v = 2; v < first_.size(); ++v) first_[v] += first_[v - 1];
    for (std::size_t t = 0; t < triangles.size(); ++t) {
        for (const std::int32_t v : triangles[t]) {
            std::int32_t& at = first_[static_cast<std::size_t>(v) + 1];
            triangles_[static_cast<std::size_t>(at++)] = static_cast<std::int32_t>(t);
        }
    }
    first_.pop_back();
}

}  // namespace batchenc
