#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <span>

#include "kernels/bending_angle.h"
#include "kernels/mesh_traversal.h"
#include "kernels/vector3.h"

namespace batchenc {

// Where a vertex is thought to be that hangs on gates, from points of its frame ("now") and of the frame
// before, by place in the traversal; of now those before the vertex are looked at. Lattice units, each
// coordinate within 2^29: then every result is finite. All arithmetic is + - * / and square root in a fixed
// order.

using GatePoints = std::span<const std::array<double, 3>>;

/// Two frames.
struct GateFrames {
    GatePoints now, before;

    const std::array<double, 3>& now_at(std::int32_t place) const {
        return now[static_cast<std::size_t>(place)];
    }
    const std::array<double, 3>& before_at(std::int32_t place) const {
        return before[static_cast<std::size_t>(place)];
    }
    std::array<double, 3> moved(std::int32_t place) const { return minus(now_at(place), before_at(place)); }
};

/// To the nearest integer; without a call, as compilers have none for floor where SSE4.1 is not assumed.
/// |value| below 2^31.
inline std::int32_t nearest_integer(double value) {
    value += 0.5;
    const auto truncated = static_cast<std::int32_t>(value);
    return truncated - static_cast<std::int32_t>(value < static_cast<double>(truncated));
}

/// The point nearest to a place, limited to 2^29 a coordinate.
inline LatticePoint nearest_point(const std::array<double, 3>& place) {
    constexpr double kLimit = 1 << 29;
    LatticePoint point;
    for (std::size_t c = 0; c < 3; ++c) {
        // Also where it is not a number, which large residuals of a corrupt stream could make it.
        const double value = place[c];
        point[c] = nearest_integer(value > -kLimit ? (value < kLimit ? value : kLimit) : -kLimit);
    }
    return point;
}

/// The corner that completes the reference triangle to a parallelogram (C. Touma and C. Gotsman, "Triangle
/// mesh compression", 1998).
inline std::array<double, 3> parallelogram(const Gate& gate, GatePoints points) {
    return minus(
        plus(points[static_cast<std::size_t>(gate.left)], points[static_cast<std::size_t>(gate.right)]),
        points[static_cast<std::size_t>(gate.opposite)]);
}

/// The place before, moved as the middle of the gate's edge moved; without a reference triangle.
inline std::array<double, 3> moved_with_edge(const Gate& gate, std::size_t place, const GateFrames& frames) {
    return plus(frames.before[place], times(0.5, plus(frames.moved(gate.left), frames.moved(gate.right))));
}

/// The place before, moved as the mean of the gates' parallelograms moved (L. Ibarria and J. Rossignac,
/// "Dynapack", 2003, has one gate).
inline std::array<double, 3> lorenzo(std::span<const Gate> gates, std::size_t place,
                                     const GateFrames& frames) {
    std::array<double, 3> sum{};
    for (const Gate& gate : gates)
        sum = plus(
            sum, minus(plus(frames.moved(gate.left), frames.moved(gate.right)), frames.moved(gate.opposite)));
    return plus(frames.before[place], times(1.0 / static_cast<double>(gates.size()), sum));
}

/// The place before in the affine frame of the gate's reference triangle, whose third axis is as long as the
/// root of the triangle's double area (likewise). False where the triangle, now or before, is too thin to say
/// what is beside it.
inline bool replica(const Gate& gate, std::size_t place, const GateFrames& frames,
                    std::array<double, 3>& predicted) {
    using Vector = std::array<double, 3>;
    const Vector a = minus(frames.before_at(gate.right), frames.before_at(gate.left));
    const Vector b = minus(frames.before_at(gate.opposite), frames.before_at(gate.left));
    const Vector n = cross(a, b);
    const double area = dot(n, n);  // squared
    const Vector new_a = minus(frames.now_at(gate.right), frames.now_at(gate.left));
    const Vector new_b = minus(frames.now_at(gate.opposite), frames.now_at(gate.left));
    const Vector new_n = cross(new_a, new_b);
    const double new_area = dot(new_n, new_n);
    const double aa = dot(a, a), ab = dot(a, b), bb = dot(b, b);
    constexpr double kThin = 1e-3;
    if (!(area > kThin * (aa * bb)) || !(new_area > kThin * (dot(new_a, new_a) * dot(new_b, new_b))))
        return false;
    const Vector d = minus(frames.before[place], frames.before_at(gate.left));
    const double da = dot(d, a), db = dot(d, b);
    const double s = (da * bb - db * ab) / area, t = (db * aa - da * ab) / area;
    // n over the root of its length, before and now.
    const double up = dot(d, n) / area * std::sqrt(std::sqrt(area / new_area));
    predicted =
        plus(frames.now_at(gate.left), plus(plus(times(s, new_a), times(t, new_b)), times(up, new_n)));
    return true;
}

/// The local coordinate system of a gate with a reference triangle: x along it, y away from the triangle's
/// third corner in its plane, z across. False where the triangle is not higher over the gate than
/// least_height.
inline bool set_gate_frame(const Gate& gate, GatePoints points, double least_height, GateFrame& frame) {
    const auto &left = points[static_cast<std::size_t>(gate.left)],
               &right = points[static_cast<std::size_t>(gate.right)];
    const std::array<double, 3> along = minus(right, left);
    const double squared_length = dot(along, along);
    frame.origin = times(0.5, plus(left, right));
    const std::array<double, 3> away = minus(frame.origin, points[static_cast<std::size_t>(gate.opposite)]);
    if (!(squared_length > 0.0)) return false;
    frame.length = std::sqrt(squared_length);
    frame.x = times(1.0 / frame.length, along);
    const std::array<double, 3> across = minus(away, times(dot(away, frame.x), frame.x));
    const double height = std::sqrt(dot(across, across));
    if (!(height > least_height)) return false;
    frame.y = times(1.0 / height, across);
    frame.z = cross(frame.x, frame.y);
    return true;
}

/// Coordinates of a place in a gate's system, and the way back.
inline std::array<double, 3> into_frame(const GateFrame& frame, const std::array<double, 3>& place) {
    const std::array<double, 3> offset = minus(place, frame.origin);
    return {dot(offset, frame.x), dot(offset, frame.y), dot(offset, frame.z)};
}
inline std::array<double, 3> out_of_frame(const GateFrame& frame, const std::array<double, 3>& local) {
    std::array<double, 3> place;
    for (std::size_t c = 0; c < 3; ++c)
        place[c] = frame.origin[c] + frame.x[c] * local[0] + frame.y[c] * local[1] + frame.z[c] * local[2];
    return place;
}

}  // namespace batchenc
