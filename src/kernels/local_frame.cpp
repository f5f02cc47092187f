#include "kernels/local_frame.h"

#include <cmath>

#include "kernels/vector3.h"

namespace batchenc {
namespace {

using Vector = std::array<double, 3>;

Vector over(const Vector& a, double s) { return {a[0] / s, a[1] / s, a[2] / s}; }

}  // namespace

LocalFrame local_frame(const Vector& p1, const Vector& p2, const Vector& p3, const LocalFrame& previous) {
    LocalFrame lcf;
    lcf.origin = {0.5 * (p1[0] + p2[0]), 0.5 * (p1[1] + p2[1]), 0.5 * (p1[2] + p2[2])};
    lcf.rotation = previous.rotation;
    const Vector edge = minus(p2, p1);
    const Vector normal = cross(edge, minus(p3, p1));
    const double edge_length = std::sqrt(dot(edge, edge));
    const double normal_length = std::sqrt(dot(normal, normal));
    if (!(edge_length > 0.0) || !(normal_length > 0.0)) return lcf;
    const Vector x = over(edge, edge_length);
    const Vector z = over(normal, normal_length);
    const Vector y = cross(z, x);
    lcf.rotation = {x[0], x[1], x[2], y[0], y[1], y[2], z[0], z[1], z[2]};
    return lcf;
}

LocalFrameTrack::LocalFrameTrack(std::int64_t frames)
    : frame_count(frames),
      stride((frames + 15) / 16 * 16),
      values(static_cast<std::size_t>(12 * stride), 0.0f) {}

void LocalFrameTrack::set(std::int64_t frame, const LocalFrame& lcf) {
    for (int k = 0; k < 9; ++k)
        values[static_cast<std::size_t>(k * stride + frame)] =
            static_cast<float>(lcf.rotation[static_cast<std::size_t>(k)]);
    for (int k = 0; k < 3; ++k)
        values[static_cast<std::size_t>((9 + k) * stride + frame)] =
            static_cast<float>(lcf.origin[static_cast<std::size_t>(k)]);
}

LocalFrameTrack triangle_track(PositionsView positions, const Triangle& triangle) {
    LocalFrameTrack track(positions.frame_count());
    LocalFrame lcf;
    for (std::int64_t f = 0; f < positions.frame_count(); ++f) {
        const auto corner = [&](std::size_t k) {
            const float* p = positions.at(f, triangle[k]);
            return Vector{p[0], p[1], p[2]};
        };
        lcf = local_frame(corner(0), corner(1), corner(2), lcf);
        track.set(f, lcf);
    }
    return track;
}

void to_local(const float* positions, std::span<const std::int32_t> vertices, const LocalFrameTrack& track,
              std::int64_t frame, float* local) {
    float t[12];
    for (int k = 0; k < 12; ++k) t[k] = track.row(k)[frame];
    for (const std::int32_t v : vertices) {
        const float* p = positions + 3 * static_cast<std::ptrdiff_t>(v);
        const float x = p[0] - t[9], y = p[1] - t[10], z = p[2] - t[11];
        for (int axis = 0; axis < 3; ++axis)
            *local++ = t[3 * axis] * x + t[3 * axis + 1] * y + t[3 * axis + 2] * z;
    }
}

void to_world(const float* local, std::span<const std::int32_t> vertices, const LocalFrameTrack& track,
              std::int64_t frame, float* positions) {
    float t[12];
    for (int k = 0; k < 12; ++k) t[k] = track.row(k)[frame];
    for (const std::int32_t v : vertices) {
        float* p = positions + 3 * static_cast<std::ptrdiff_t>(v);
        for (int axis = 0; axis < 3; ++axis)
            p[axis] = t[axis] * local[0] + t[3 + axis] * local[1] + t[6 + axis] * local[2] + t[9 + axis];
        local += 3;
    }
}

}  // namespace batchenc
