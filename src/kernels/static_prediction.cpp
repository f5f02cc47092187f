#include "kernels/static_prediction.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "kernels/vector3.h"

namespace batchenc {
namespace {

using Vector = std::array<double, 3>;

constexpr std::int32_t kLargestSize = 1 << 23;
constexpr double kMemory = 0.998;         // weight of what was before, when a fit learns
constexpr std::int32_t kLoneSize = 1600;  // a hundred steps, to begin with

constexpr double kLeastRadius = 1.0;  // of a circle, lattice units

bool is_local(GeometryPredictor predictor) {
    return predictor >= GeometryPredictor::kLocalParallelogram && !bends(predictor);
}
bool corrects(const PredictionForm& form) {
    return form.predictor == GeometryPredictor::kFitted ||
           (bends(form.predictor) && (form.tangential == TangentialPredictor::kFitted ||
                                      form.tangential == TangentialPredictor::kWeighted));
}
bool weighs(const PredictionForm& form) {
    return form.predictor == GeometryPredictor::kWeighted ||
           (bends(form.predictor) && form.tangential == TangentialPredictor::kWeighted);
}
bool is_multiway(const PredictionForm& form) {
    if (bends(form.predictor)) return form.tangential != TangentialPredictor::kParallelogram;
    return form.predictor != GeometryPredictor::kParallelogram &&
           form.predictor != GeometryPredictor::kLocalParallelogram;
}

/// To the nearest, either way from the middle: only the encoder rounds here. A fit that learnt from tiny
/// triangles may predict places far outside; their residuals stop at 2^30, which leads nowhere near the
/// vertex, so that it is coded exactly.
std::int32_t rounded(double steps) {
    constexpr double kLimit = 1 << 30;
    steps += steps < 0.0 ? -0.5 : 0.5;
    return static_cast<std::int32_t>(steps > -kLimit ? (steps < kLimit ? steps : kLimit) : -kLimit);
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

bool needs_surface(const PredictionForm& form) { return bends(form.predictor) || weighs(form); }

StaticPrediction::StaticPrediction(const MeshTraversal& traversal, const Surface& surface,
                                   const PredictionForm& form)
    : traversal_(traversal),
      form_(form),
      decoded_(traversal.order.size()),
      lone_sizes_{kLoneSize, kLoneSize, kLoneSize} {
    if (weighs(form)) {
        constexpr double kFullTurn = 6.28318530717958647692;
        for (std::size_t h = 0; h < surface.fan.size(); ++h) {
            const auto fan = static_cast<std::size_t>(surface.fan[h]);
            // An open fan goes half around.
            const std::int32_t size = std::max(3, surface.fan_size[fan] * (surface.fan_is_open[fan] ? 2 : 1));
            const UnitVector angle = unit_vector(kFullTurn / size);
            decoded_[static_cast<std::size_t>(surface.start(static_cast<std::int32_t>(h)))].cotangent =
                static_cast<float>(angle.cosine / angle.sine);
        }
    }
    if (bends(form.predictor)) bending_.emplace(surface, form.fit, form.predictor, decoded_.size());
}

inline StaticPrediction::Vector StaticPrediction::at(std::int32_t place) const {
    const LatticePoint& p = decoded_[static_cast<std::size_t>(place)].point;
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
    if (!is_multiway(form_)) gates = gates.first(1);
    Vector sum{};
    for (const Gate& gate : gates) sum = plus(sum, beyond(gate));
    prediction.place = times(1.0 / static_cast<double>(gates.size()), sum);
    gates_ = gates.size() > 1 ? 2 : 1;
    prediction.gates = gates_;
    if (corrects(form_)) correct(gates, prediction.place);
    if (is_local(form_.predictor)) {
        set_axes(gates, prediction);
        double bends = 0.0;
        for (const Gate& gate : gates) {
            bends += static_cast<double>(decoded_[static_cast<std::size_t>(gate.left)].bend);
            bends += static_cast<double>(decoded_[static_cast<std::size_t>(gate.right)].bend);
        }
        bend_ = bends * static_cast<double>(form_.curvature) / (32.0 * static_cast<double>(gates.size()));
        for (std::size_t c = 0; c < 3; ++c)
            prediction.place[c] += bend_ * kLatticeParts * prediction.axes[6 + c];
    }
    set_sizes(gates, prediction);
    if (bending_) set_circle(gates[0], prediction);
    return prediction;
}

void StaticPrediction::set_circle(const Gate& gate, VertexPrediction& prediction) const {
    const Vector left = at(gate.left), right = at(gate.right);
    const Vector origin = times(0.5, plus(left, right));
    const Vector along = minus(right, left);
    const double length = std::sqrt(dot(along, along));
    if (!(length > 0.0)) return;
    const Vector x = times(1.0 / length, along);
    const Vector away = minus(origin, at(gate.opposite));
    const Vector across = minus(away, times(dot(away, x), x));
    const double height = std::sqrt(dot(across, across));
    if (!(height > 1e-3)) return;
    const Vector y = times(1.0 / height, across);
    const Vector z = cross(x, y);
    const Vector offset = minus(prediction.place, origin);
    const double up = dot(offset, y), out = dot(offset, z);
    prediction.tangential = {dot(offset, x), std::sqrt(up * up + out * out)};
    prediction.place = origin;
    prediction.axes = {x[0], x[1], x[2], y[0], y[1], y[2], z[0], z[1], z[2]};
    prediction.in_world_axes = false;
    prediction.gate = &gate;
    prediction.gate_length = length;
}

const UnitVector& StaticPrediction::bend_of(VertexPrediction& prediction, double x, double radius) {
    if (!prediction.bend) {
        const auto& axes = prediction.axes;
        const GateFrame frame = {prediction.place,
                                 {axes[0], axes[1], axes[2]},
                                 {axes[3], axes[4], axes[5]},
                                 {axes[6], axes[7], axes[8]},
                                 prediction.gate_length};
        prediction.bend = bending_->predict(*prediction.gate, frame, x, radius);
    }
    return *prediction.bend;
}

std::array<std::int32_t, 3> StaticPrediction::residuals_of(VertexPrediction& prediction,
                                                           const std::array<double, 3>& place) {
    const Vector off = minus(place, prediction.place);
    if (prediction.in_world_axes)
        return {rounded(off[0] / kLatticeParts), rounded(off[1] / kLatticeParts),
                rounded(off[2] / kLatticeParts)};
    const auto along = [&](std::size_t axis) {
        const double* row = prediction.axes.data() + 3 * axis;
        return row[0] * off[0] + row[1] * off[1] + row[2] * off[2];
    };
    const double x = along(0), y = along(1), z = along(2);
    if (!prediction.gate)
        return {rounded(x / kLatticeParts), rounded(y / kLatticeParts), rounded(z / kLatticeParts)};
    std::array<std::int32_t, 3> residuals{};
    residuals[0] = rounded((x - prediction.tangential[0]) / kLatticeParts);
    residuals[1] = rounded((std::sqrt(y * y + z * z) - prediction.tangential[1]) / kLatticeParts);
    const double radius =
        std::max(kLeastRadius, prediction.tangential[1] + residuals[1] * double{kLatticeParts});
    const UnitVector& bend =
        bend_of(prediction, prediction.tangential[0] + residuals[0] * double{kLatticeParts}, radius);
    const double turn = angle_of(bend.cosine * y + bend.sine * z, bend.cosine * z - bend.sine * y);
    residuals[2] = rounded(turn * radius / kLatticeParts);
    return residuals;
}

inline Vector StaticPrediction::beyond(const Gate& gate) const {
    const Vector left = at(gate.left), right = at(gate.right);
    if (!weighs(form_)) return minus(plus(left, right), at(gate.opposite));
    // The corner behind, mirrored in the point of the gate below which triangles of such angles have their
    // third corners.
    const auto l = static_cast<double>(decoded_[static_cast<std::size_t>(gate.left)].cotangent);
    const auto r = static_cast<double>(decoded_[static_cast<std::size_t>(gate.right)].cotangent);
    const double part = l + r > 0.1 ? std::clamp(l / (l + r), 0.0, 1.0) : 0.5;
    return minus(plus(times(2.0 * (1.0 - part), left), times(2.0 * part, right)), at(gate.opposite));
}

std::vector<LatticePoint> StaticPrediction::points() const {
    std::vector<LatticePoint> points(decoded_.size());
    for (std::size_t k = 0; k < points.size(); ++k)
        points[static_cast<std::size_t>(traversal_.order[k])] = decoded_[k].point;
    return points;
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
    prediction.axes = {1, 0, 0, 0, 1, 0, 0, 0, 1};  // where there is no plane
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

inline void StaticPrediction::set_sizes(std::span<const Gate> gates, VertexPrediction& prediction) const {
    // The first two gates' ends, and with one gate the corner behind it.
    std::array<std::int32_t, 3> sum{};  // at most five of kLargestSize
    std::int32_t count = 0;
    const auto add = [&](std::int32_t place) {
        const auto& sizes = decoded_[static_cast<std::size_t>(place)].sizes;
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

LatticePoint StaticPrediction::reconstruct(VertexPrediction& prediction,
                                           const std::array<std::int32_t, 3>& residuals) {
    constexpr double kLimit = 1 << 29;
    LatticePoint point;
    Vector circle{};  // along the axes
    if (prediction.gate) {
        circle[0] = prediction.tangential[0] + static_cast<double>(residuals[0]) * kLatticeParts;
        const double radius = std::max(
            kLeastRadius, prediction.tangential[1] + static_cast<double>(residuals[1]) * kLatticeParts);
        const UnitVector& bend = bend_of(prediction, circle[0], radius);
        const UnitVector turn =
            unit_vector(std::clamp(static_cast<double>(residuals[2]) * kLatticeParts / radius, -4.0, 4.0));
        circle[1] = radius * (bend.cosine * turn.cosine - bend.sine * turn.sine);
        circle[2] = radius * (bend.cosine * turn.sine + bend.sine * turn.cosine);
    }
    for (std::size_t c = 0; c < 3; ++c) {
        double value = prediction.place[c];
        if (prediction.gate) {
            for (std::size_t k = 0; k < 3; ++k) value += prediction.axes[3 * k + c] * circle[k];
        } else if (prediction.in_world_axes) {  // what the sums below come to, without the work
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
    Decoded& vertex = decoded_[place];
    vertex.point = decoded;
    if (bending_) bending_->add(place, decoded);
    for (std::size_t k = 0; k < 3; ++k) {
        const std::int64_t size = std::abs(std::int64_t{residuals[k]}) * kLatticeParts;
        vertex.sizes[k] = static_cast<std::int32_t>(std::min<std::int64_t>(size, kLargestSize));
    }
    if (traversal_.gates_of(place).empty()) {
        for (std::size_t k = 0; k < 3; ++k) lone_sizes_[k] += (vertex.sizes[k] - lone_sizes_[k]) / 8;
    }
    if (gates_ > 0) vertex.bend = static_cast<float>(residuals[2] + bend_);
    if (!fit_) return;
    const Vector missed = minus(at(static_cast<std::int32_t>(place)), plain_);
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
