#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace batchenc {

/// Three vertex indices, counter-clockwise as the source has them.
using Triangle = std::array<std::int32_t, 3>;

/// Squared distance of two points of three coordinates, in double precision.
inline double squared_distance(const float* a, const float* b) {
    double sum = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        const double d = static_cast<double>(a[axis]) - static_cast<double>(b[axis]);
        sum += d * d;
    }
    return sum;
}

/// Read-only positions of a run of frames: [frame][vertex][xyz], float32, contiguous, not owned.
class PositionsView {
 public:
    PositionsView() = default;
    PositionsView(const float* data, std::int64_t frame_count, std::int64_t vertex_count)
        : data_(data), frame_count_(frame_count), vertex_count_(vertex_count) {}

    const float* data() const { return data_; }
    std::int64_t frame_count() const { return frame_count_; }
    std::int64_t vertex_count() const { return vertex_count_; }
    std::int64_t value_count() const { return frame_count_ * vertex_count_ * 3; }
    std::int64_t size_bytes() const { return value_count() * static_cast<std::int64_t>(sizeof(float)); }

    /// The three coordinates of a vertex in a frame.
    const float* at(std::int64_t frame, std::int64_t vertex) const {
        return data_ + (frame * vertex_count_ + vertex) * 3;
    }
    /// Frames [begin, end) of this view.
    PositionsView frames(std::int64_t begin, std::int64_t end) const {
        return {at(begin, 0), end - begin, vertex_count_};
    }

 private:
    const float* data_ = nullptr;
    std::int64_t frame_count_ = 0;
    std::int64_t vertex_count_ = 0;
};

/// Writable positions of a run of frames; same layout as PositionsView.
class MutablePositionsView {
 public:
    MutablePositionsView() = default;
    MutablePositionsView(float* data, std::int64_t frame_count, std::int64_t vertex_count)
        : data_(data), frame_count_(frame_count), vertex_count_(vertex_count) {}

    float* data() const { return data_; }
    std::int64_t frame_count() const { return frame_count_; }
    std::int64_t vertex_count() const { return vertex_count_; }
    float* at(std::int64_t frame, std::int64_t vertex) const {
        return data_ + (frame * vertex_count_ + vertex) * 3;
    }
    operator PositionsView() const { return {data_, frame_count_, vertex_count_}; }

 private:
    float* data_ = nullptr;
    std::int64_t frame_count_ = 0;
    std::int64_t vertex_count_ = 0;
};

/// A whole clip in memory: positions of every frame and one connectivity for all of them.
struct MeshSequence {
    std::int64_t frame_count = 0;
    std::int64_t vertex_count = 0;
    std::vector<float> positions;     ///< [F][V][3], world units
    std::vector<Triangle> triangles;  ///< T triangles; empty for points
    double fps = 0.0;                 ///< frames per second; 0 where the source does not say
    std::string name;                 ///< from the source; may be empty

    PositionsView view() const { return {positions.data(), frame_count, vertex_count}; }
    MutablePositionsView view() { return {positions.data(), frame_count, vertex_count}; }
};

}  // namespace batchenc
