#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/mesh_sequence.h"

namespace batchenc {

/// Local coordinate frame (LCF) of a triangle in one frame of the animation (4.5.2): q = rotation (p -
/// origin).
struct LocalFrame {
    std::array<double, 9> rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1};  ///< rows are the axes x, y, z
    std::array<double, 3> origin = {0, 0, 0};                      ///< world units
};

/// LCF of the triangle p1 p2 p3: origin at the middle of edge p1 p2, x along that edge, y in the plane
/// towards p3, z = x × y. A triangle without area takes the rotation of `previous` and keeps its own origin,
/// so that the frame is defined always. Uses + - * / and sqrt in a fixed order: the same bits on every
/// machine.
LocalFrame local_frame(const std::array<double, 3>& p1, const std::array<double, 3>& p2,
                       const std::array<double, 3>& p3, const LocalFrame& previous);

/// The LCFs of one cluster over the frames of a clip, as float32 structure of arrays: value k of frame f is
/// at k * stride + f. Values 0 … 8 are the rotation row by row, 9 … 11 the origin. stride is frame_count
/// rounded up to 16, the rest zero.
struct LocalFrameTrack {
    std::int64_t frame_count = 0;
    std::int64_t stride = 0;
    std::vector<float> values;

    explicit LocalFrameTrack(std::int64_t frames);
    void set(std::int64_t frame, const LocalFrame& lcf);
    const float* row(int k) const { return values.data() + k * stride; }
};

/// Local coordinates of one frame: q = T (p - o) with the LCF of `frame` in the track, three values a vertex.
void to_local(const float* positions, std::span<const std::int32_t> vertices, const LocalFrameTrack& track,
              std::int64_t frame, float* local);
/// And back, scattered to the vertices' places: p = Tᵀ q + o.
void to_world(const float* local, std::span<const std::int32_t> vertices, const LocalFrameTrack& track,
              std::int64_t frame, float* positions);

/// The LCFs of a triangle of vertices in every frame; where it has no area, the rotation of the frame before.
LocalFrameTrack triangle_track(PositionsView positions, const Triangle& triangle);

}  // namespace batchenc
