#include "bench/peers/time_rows.h"

#include <numeric>

#include "kernels/mesh_traversal.h"

namespace batchenc {

void TimeRows::take_shape(const MeshSequence& clip) {
    if (clip_ == clip.positions.data()) return;
    clip_ = clip.positions.data();
    frames_ = static_cast<std::size_t>(clip.frame_count);
    if (in_mesh_order_) {
        order_ = MeshTraversal::of(clip.triangles, clip.vertex_count).order;
    } else {
        order_.resize(static_cast<std::size_t>(clip.vertex_count));
        std::iota(order_.begin(), order_.end(), 0);
    }
}

/// Calls visit(place in the plane, place in the clip).
template <typename Visit>
void TimeRows::each_value(Visit visit) const {
    const std::size_t vertices = order_.size();
    for (std::size_t axis = 0; axis < 3; ++axis) {
        for (std::size_t row = 0; row < vertices; ++row) {
            const auto v = static_cast<std::size_t>(order_[row]);
            for (std::size_t f = 0; f < frames_; ++f)
                visit((axis * vertices + row) * frames_ + f, (f * vertices + v) * 3 + axis);
        }
    }
}

void TimeRows::gather(const MeshSequence& clip, double unit, std::vector<float>& values) const {
    values.resize(clip.positions.size());
    each_value([&](std::size_t to, std::size_t from) {
        values[to] = static_cast<float>(static_cast<double>(clip.positions[from]) / unit);
    });
}

void TimeRows::scatter(const std::vector<float>& values, double unit, std::vector<float>& positions) const {
    positions.resize(values.size());
    each_value([&](std::size_t from, std::size_t to) {
        positions[to] = static_cast<float>(static_cast<double>(values[from]) * unit);
    });
}

}  // namespace batchenc
