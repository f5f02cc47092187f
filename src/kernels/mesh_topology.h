#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "core/mesh_sequence.h"
#include "kernels/cluster_traversal.h"
#include "kernels/field_order.h"
#include "kernels/mesh_traversal.h"
#include "kernels/surface.h"

namespace batchenc {

/// The triangles of a mesh, and what coders derive from them: each found when it is first asked for and then
/// kept, as all clips of a sequence share it. Any thread may ask.
class MeshTopology {
 public:
    /// triangles: none for points; every index in [0, vertex_count), fewer than 2^31 / 3.
    MeshTopology(std::vector<Triangle> triangles, std::int64_t vertex_count)
        : triangles_(std::move(triangles)), vertex_count_(vertex_count) {}

    std::int64_t vertex_count() const { return vertex_count_; }
    const std::vector<Triangle>& triangles() const { return triangles_; }
    bool is_points() const { return triangles_.empty(); }

    const MeshAdjacency& adjacency() const {
        std::call_once(adjacency_once_,
                       [this] { adjacency_ = MeshAdjacency::of(triangles_, vertex_count_); });
        return adjacency_;
    }
    const MeshTraversal& traversal() const {
        std::call_once(traversal_once_,
                       [this] { traversal_ = MeshTraversal::of(triangles_, vertex_count_); });
        return traversal_;
    }
    const FieldOrder& field_order() const {
        std::call_once(field_order_once_, [this] { field_order_ = FieldOrder::of_whole(*this); });
        return field_order_;
    }
    /// The triangles glued, with the traversal's places for vertices.
    const Surface& surface() const {
        std::call_once(surface_once_, [this] { surface_ = Surface::of(traversal().in_places(triangles_)); });
        return surface_;
    }

    /// The same where it is wanted, an empty one elsewhere, which costs nothing.
    const Surface& surface_if(bool is_wanted) const { return is_wanted ? surface() : no_surface_; }

 private:
    std::vector<Triangle> triangles_;
    std::int64_t vertex_count_;
    mutable std::once_flag adjacency_once_, traversal_once_, surface_once_, field_order_once_;
    mutable MeshAdjacency adjacency_;
    mutable MeshTraversal traversal_;
    mutable Surface surface_;
    mutable FieldOrder field_order_;
    Surface no_surface_;
};

/// Decoded clips outlive the call that made them; never null.
using SharedMesh = std::shared_ptr<const MeshTopology>;

}  // namespace batchenc
