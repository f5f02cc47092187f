#pragma once

#include <cstdint>
#include <vector>

#include "core/mesh_sequence.h"

namespace batchenc {

/// A clip as a plane of 3 V rows of F values: each row a coordinate along time, rows by axis, then by vertex.
/// Of the layouts tried with zfp (rows as one line, three dimensions) the smallest by far.
class TimeRows {
 public:
    /// in_mesh_order: vertices as the coder of connectivity visits them, so that neighbours in the plane are
    /// mostly neighbours on the mesh, which a decoder with the connectivity knows; else as the clip has them.
    explicit TimeRows(bool in_mesh_order) : in_mesh_order_(in_mesh_order) {}

    /// Takes up the clip's shape and order; does nothing where it has them already.
    void take_shape(const MeshSequence& clip);
    std::size_t frames() const { return frames_; }
    std::size_t vertices() const { return order_.size(); }
    bool in_mesh_order() const { return in_mesh_order_; }

    /// values: every coordinate over `unit`.
    void gather(const MeshSequence& clip, double unit, std::vector<float>& values) const;
    /// The way back.
    void scatter(const std::vector<float>& values, double unit, std::vector<float>& positions) const;

 private:
    template <typename Visit>
    void each_value(Visit visit) const;

    bool in_mesh_order_;
    const void* clip_ = nullptr;  // whose shape it is
    std::size_t frames_ = 0;
    std::vector<std::int32_t> order_;  // the vertex of each row
};

}  // namespace batchenc
