#include "kernels/static_prediction.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace batchenc {
namespace {

using Vector = std::array<double, 3>;

Vector plus(const Vector& a, const Vector& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
Vector minus(const Vector& a, const Vector& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
Vector times(double s, const Vector& a) { return {s * a[0], s * a[1], s * a[2]}; }
double dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Vector cross(const Vector& a, const Vector& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

constexpr std::int32_t kLargestSize = 1 << 23;
constexpr double kMemory = 0.998;         // weight of what was before, when a fit learns
constexpr std::int32_t kLoneSize = 1600;  // a hundred steps, to begin with

bool is_local(GeometryPredictor predictor) { return predictor >= GeometryPredictor::kLocalParallelogram; }
bool is_multiway(GeometryPredictor predictor) {
    return predictor != GeometryPredictor::kParallelogram &&
           predictor != GeometryPredictor::kLocalParallelogram;
}

/// Two gates that share a vertex: that vertex, and the two others.
bool find_shared(const Gate& a, const Gate& b, std::int32_t& shared, std::int32_t& first,
                 std::int32_t& second) {
    const bool left = a.left == b.left || a.left == b.right;
    const bool right = a.right == b.left || a.right == b.right;
    if (left == right) return false;
    shared = left ? a.left : a.right;
    first = left ? a.right : a.left;
    second = b.left == shared ? b.right : b.left;
    return true;
}

}  // namespace

StaticPrediction::StaticPrediction(const MeshTraversal& traversal, const PredictionForm& form)
    : traversal_(traversal),
      form_(form),
      points_(traversal.order.size()),
      sizes_(traversal.order.size()),
      bends_(traversal.order.size(), 0.0f),
      lone_sizes_{kLoneSize, kLoneSize, kLoneSize} {}

StaticPrediction::Vector StaticPrediction::at(std::int32_t v) const {
    const LatticePoint& p = points_[static_cast<std::size_t>(v)];
    return {static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])};
}

VertexPrediction StaticPrediction::predict(std::size_t place) {
    VertexPrediction prediction;
    std::span<const Gate> gates = traversal_.gates_of(place);
    fit_ = nullptr;
    bend_ = 0.0;
    gates_ = 0;
    if (gates.empty()) {
        const std::int32_t anchor = traversal_.anchor[place];
        if (anchor >= 0) prediction.place = at(anchor);
        prediction.sizes = lone_sizes_;
        return prediction;
    }
    if (gates[0].opposite < 0) {
        prediction.place = times(0.5, plus(at(gates[0].left), at(gates[0].right)));
        set_sizes(gates, prediction);
        for (std::int32_t& size : prediction.sizes)
            size = std::min(kLargestSize, 3 * size + 5 * kLatticeParts);
        return prediction;
    }
    if (!is_multiway(form_.predictor)) gates = gates.first(1);
    Vector sum{};
    for (const Gate& gate : gates)
        sum = plus(sum, minus(plus(at(gate.left), at(gate.right)), at(gate.opposite)));
    prediction.place = times(1.0 / static_cast<double>(gates.size()), sum);
    gates_ = gates.size() > 1 ? 2 : 1;
    prediction.gates = gates_;
    if (form_.predictor == GeometryPredictor::kFitted) correct(gates, prediction.place);
    if (is_local(form_.predictor)) {
        set_axes(gates, prediction);
        double bends = 0.0;
        for (const Gate& gate : gates) {
            bends += static_cast<double>(bends_[static_cast<std::size_t>(gate.left)]);
            bends += static_cast<double>(bends_[static_cast<std::size_t>(gate.right)]);
        }
        bend_ = bends * static_cast<double>(form_.curvature) / (32.0 * static_cast<double>(gates.size()));
        for (std::size_t c = 0; c < 3; ++c)
            prediction.place[c] += bend_ * kLatticeParts * prediction.axes[6 + c];
    }
    set_sizes(gates, prediction);
    return prediction;
}

void StaticPrediction::correct(std::span<const Gate> gates, Vector& place) {
    plain_ = place;
    v_ = {};
    std::int32_t shared = -1, first = -1, second = -1;
    if (gates.size() == 2 && find_shared(gates[0], gates[1], shared, first, second)) {
        // The ring from first over shared to second: its ends and the corners behind, against its middle.
        const Vector twice = times(2.0, at(shared));
        u_ = minus(plus(at(first), at(second)), twice);
        v_ = minus(plus(at(gates[0].opposite), at(gates[1].opposite)), twice);
        fit_ = &fits_[3];
    } else {
        Vector ring{};
        for (const Gate& gate : gates) ring = plus(ring, plus(at(gate.left), at(gate.right)));
        ring = times(0.5 / static_cast<double>(gates.size()), ring);
        u_ = minus(ring, place);
        if (gates.size() == 1) {
            // Along the gate: how far the corner behind it lies to one side.
            const Vector along = minus(at(gates[0].right), at(gates[0].left));
            const double square = dot(along, along);
            if (square > 0.0) v_ = times(dot(minus(at(gates[0].opposite), ring), along) / square, along);
        }
        fit_ = &fits_[std::min<std::size_t>(gates.size(), 3) - 1];
    }
    const Fit& fit = *fit_;
    const double uu = 1.001 * fit.uu + 1e-6, vv = 1.001 * fit.vv + 1e-6;
    const double determinant = uu * vv - fit.uv * fit.uv;
    const double u = (fit.ut * vv - fit.vt * fit.uv) / determinant;
    const double v = (fit.vt * uu - fit.ut * fit.uv) / determinant;
    place = plus(place, plus(times(u, u_), times(v, v_)));
}

void StaticPrediction::set_axes(std::span<const Gate> gates, VertexPrediction& prediction) const {
    Vector normal{};
    for (const Gate& gate : gates) {
        const Vector left = at(gate.left);
        normal = plus(normal, cross(minus(at(gate.right), left), minus(left, at(gate.opposite))));
    }
    const double normal_length = std::sqrt(dot(normal, normal));
    if (!(normal_length > 0.0)) return;
    const Vector z = times(1.0 / normal_length, normal);
    Vector x = minus(at(gates[0].right), at(gates[0].left));
    x = minus(x, times(dot(x, z), z));
    const double length = std::sqrt(dot(x, x));
    if (!(length > 1e-3)) return;
    x = times(1.0 / length, x);
    const Vector y = cross(z, x);
    prediction.axes = {x[0], x[1], x[2], y[0], y[1], y[2], z[0], z[1], z[2]};
    prediction.in_world_axes = false;
}

void StaticPrediction::set_sizes(std::span<const Gate> gates, VertexPrediction& prediction) const {
    // The first two gates' ends, and with one gate the corner behind it.
    std::array<std::int32_t, 3> sum{};  // at most five of kLargestSize
    std::int32_t count = 0;
    const auto add = [&](std::int32_t v) {
        const auto& sizes = sizes_[static_cast<std::size_t>(v)];
        for (std::size_t k = 0; k < 3; ++k) sum[k] += sizes[k];
        ++count;
    };
    for (const Gate& gate : gates.first(std::min<std::size_t>(gates.size(), 2))) {
        add(gate.left);
        add(gate.right);
    }
    if (gates.size() == 1 && gates[0].opposite >= 0) add(gates[0].opposite);
    for (std::size_t k = 0; k < 3; ++k) prediction.sizes[k] = sum[k] / count;
}

LatticePoint StaticPrediction::reconstruct(const VertexPrediction& prediction,
                                           const std::array<std::int32_t, 3>& residuals) {
    constexpr double kLimit = 1 << 29;
    LatticePoint point;
    for (std::size_t c = 0; c < 3; ++c) {
        double value = prediction.place[c];
        if (prediction.in_world_axes) {  // what the sums below come to, without the work
            value += static_cast<double>(residuals[c]) * kLatticeParts;
        } else {
            for (std::size_t k = 0; k < 3; ++k)
                value += prediction.axes[3 * k + c] * static_cast<double>(residuals[k]) * kLatticeParts;
        }
        // Also where the sum is not a number, which large residuals of a corrupt stream could make it.
        value = value > -kLimit ? (value < kLimit ? value : kLimit) : -kLimit;
        // floor(value + 0.5) without a call: truncation, and one less where that went up.
        value += 0.5;
        const auto truncated = static_cast<std::int32_t>(value);
        point[c] = truncated - static_cast<std::int32_t>(value < static_cast<double>(truncated));
    }
    return point;
}

void StaticPrediction::record(std::size_t place, const std::array<std::int32_t, 3>& residuals,
                              const LatticePoint& decoded) {
    const auto v = static_cast<std::size_t>(traversal_.order[place]);
    points_[v] = decoded;
    for (std::size_t k = 0; k < 3; ++k) {
        const std::int64_t size = std::abs(std::int64_t{residuals[k]}) * kLatticeParts;
        sizes_[v][k] = static_cast<std::int32_t>(std::min<std::int64_t>(size, kLargestSize));
    }
    if (traversal_.gates_of(place).empty()) {
        for (std::size_t k = 0; k < 3; ++k) lone_sizes_[k] += (sizes_[v][k] - lone_sizes_[k]) / 8;
    }
    if (gates_ > 0) bends_[v] = static_cast<float>(residuals[2] + bend_);
    if (!fit_) return;
    const Vector missed = minus(at(static_cast<std::int32_t>(v)), plain_);
    // By the size of the neighbourhood, so that large triangles do not decide alone.
    const double weight = 1.0 / (dot(u_, u_) + dot(v_, v_) + 1.0);
    Fit& fit = *fit_;
    fit.uu = kMemory * fit.uu + weight * dot(u_, u_);
    fit.uv = kMemory * fit.uv + weight * dot(u_, v_);
    fit.vv = kMemory * fit.vv + weight * dot(v_, v_);
    fit.ut = kMemory * fit.ut + weight * dot(u_, missed);
    fit.vt = kMemory * fit.vt + weight * dot(v_, missed);
}

}  // namespace batchenc
