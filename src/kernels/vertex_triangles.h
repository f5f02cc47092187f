#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/mesh_sequence.h"

namespace batchenc {

/// Triangles at every vertex, as compressed rows; a degenerate triangle stands once for each of its corners.
class VertexTriangles {
 public:
    /// triangles: every index in [0, vertex_count), T below 2^31 / 3.
    VertexTriangles(std::span<const Triangle> triangles, std::int64_t vertex_count);

    /// Numbers of the triangles that have the vertex as a corner, ascending.
    std::span<const std::int32_t> of(std::int32_t vertex) const {
        const auto v = static_cast<std::size_t>(vertex);
        return std::span(triangles_)
            .subspan(static_cast<std::size_t>(first_[v]),
                     static_cast<std::size_t>(first_[v + 1] - first_[v]));
    }

 private:
    std::vector<std::int32_t> first_;      // V + 1
    std::vector<std::int32_t> triangles_;  // 3 T
};

}  // namespace batchenc
