#pragma once

#include <array>
#include <cmath>

namespace batchenc {

// Three coordinates in double precision, each operation in one order of sums.

inline std::array<double, 3> plus(const std::array<double, 3>& a, const std::array<double, 3>& b) {
    return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
inline std::array<double, 3> minus(const std::array<double, 3>& a, const std::array<double, 3>& b) {
    return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
inline std::array<double, 3> times(double s, const std::array<double, 3>& a) {
    return {s * a[0], s * a[1], s * a[2]};
}
inline double dot(const std::array<double, 3>& a, const std::array<double, 3>& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
inline double norm(const std::array<double, 3>& a) { return std::sqrt(dot(a, a)); }
inline std::array<double, 3> cross(const std::array<double, 3>& a, const std::array<double, 3>& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

}  // namespace batchenc
