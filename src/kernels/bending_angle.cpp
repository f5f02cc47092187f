#include "kernels/bending_angle.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "kernels/vector3.h"

namespace batchenc {
namespace {

constexpr std::int32_t kNone = -1;
constexpr std::size_t kTrianglesAVertex = 4;  // looked at while gathering, at most

/// Solves (m + ridge) x = b for symmetric positive m by Cholesky; false where that is no such matrix.
template <std::size_t kSize>
class Cholesky {
 public:
    using Matrix = std::array<std::array<double, kSize>, kSize>;  // lower triangle
    bool factor(const Matrix& m, double ridge) {
        factor_ = m;
        for (std::size_t i = 0; i < kSize; ++i) {
            factor_[i][i] += ridge;
            for (std::size_t j = 0; j <= i; ++j) {
                double sum = factor_[i][j];
                for (std::size_t k = 0; k < j; ++k) sum -= factor_[i][k] * factor_[j][k];
                if (i != j) {
                    factor_[i][j] = sum * inverse_[j];
                } else {
                    if (!(sum > 0.0)) return false;
                    inverse_[i] = 1.0 / std::sqrt(sum);
                }
            }
        }
        return true;
    }
    void solve(std::array<double, kSize>& b) const {
        for (std::size_t i = 0; i < kSize; ++i) {
            for (std::size_t k = 0; k < i; ++k) b[i] -= factor_[i][k] * b[k];
            b[i] *= inverse_[i];
        }
        for (std::size_t i = kSize; i-- > 0;) {
            for (std::size_t k = i + 1; k < kSize; ++k) b[i] -= factor_[k][i] * b[k];
            b[i] *= inverse_[i];
        }
    }

 private:
    Matrix factor_{};
    std::array<double, kSize> inverse_{};
};

template <std::size_t kSize>
void add_square(typename Cholesky<kSize>::Matrix& m, double w, const std::array<double, kSize>& v) {
    for (std::size_t i = 0; i < kSize; ++i) {
        const double scaled = w * v[i];
        for (std::size_t j = 0; j <= i; ++j) m[i][j] += scaled * v[j];
    }
}

bool set_direction(double cosine, double sine, UnitVector& direction) {
    const double length = std::sqrt(cosine * cosine + sine * sine);
    if (!(length > 0.0)) return false;
    direction = {cosine / length, sine / length};
    return true;
}

}  // namespace

BendingAngle::BendingAngle(const Surface& surface, const NormalFit& fit, GeometryPredictor predictor,
                           std::size_t vertex_count)
    : surface_(surface),
      fit_(fit),
      predictor_(predictor),
      points_(vertex_count),
      is_decoded_(vertex_count, 0),
      normals_(surface.triangles.size()),
      has_normal_(surface.triangles.size(), 0),
      vertex_seen_(vertex_count, 0),
      triangle_seen_(surface.triangles.size(), 0) {}

BendingAngle::Vector BendingAngle::at(std::int32_t v) const {
    const LatticePoint& p = points_[static_cast<std::size_t>(v)];
    return {static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])};
}

BendingAngle::Vector BendingAngle::local(std::int32_t v, const GateFrame& frame) const {
    const Vector p = minus(at(v), frame.origin);
    return {dot(p, frame.x), dot(p, frame.y), dot(p, frame.z)};
}

bool BendingAngle::is_decoded(std::int32_t triangle) const {
    const Triangle& t = surface_.triangles[static_cast<std::size_t>(triangle)];
    return is_decoded_[static_cast<std::size_t>(t[0])] && is_decoded_[static_cast<std::size_t>(t[1])] &&
           is_decoded_[static_cast<std::size_t>(t[2])];
}

const BendingAngle::Vector* BendingAngle::normal_of(std::int32_t triangle) {
    const auto t = static_cast<std::size_t>(triangle);
    if (has_normal_[t] == 0) {
        const Triangle& corners = surface_.triangles[t];
        const Vector a = at(corners[0]);
        const Vector normal = cross(minus(at(corners[1]), a), minus(at(corners[2]), a));
        const double length = std::sqrt(dot(normal, normal));
        has_normal_[t] = length > 0.0 ? 1 : 2;
        if (length > 0.0) normals_[t] = times(1.0 / length, normal);
    }
    return has_normal_[t] == 1 ? &normals_[t] : nullptr;
}

UnitVector BendingAngle::predict(const Gate& gate, const GateFrame& frame, double x, double radius) {
    UnitVector direction;
    bool done = false;
    ++asked_;
    switch (predictor_) {
        case GeometryPredictor::kHope:
            gather(gate, frame);
            done = predict_graph(x, radius, direction);
            break;
        case GeometryPredictor::kHopi:
            gather(gate, frame);
            done = predict_implicit(x, radius, direction);
            break;
        case GeometryPredictor::kHops:
            done = predict_sphere(gate, frame, x, radius, direction);
            break;
        default:
            return predict_creases(gate, frame);
    }
    if (done) return direction;
    ++fell_back_;
    return predict_creases(gate, frame);
}

UnitVector BendingAngle::predict_creases(const Gate& gate, const GateFrame& frame) {
    UnitVector sum{0.0, 0.0};
    for (std::int32_t h = 3 * gate.triangle; h < 3 * gate.triangle + 3; ++h) {
        const std::int32_t other = surface_.twin[static_cast<std::size_t>(h)];
        if (other == kNone || !is_decoded(other / 3)) continue;
        const Vector a = at(surface_.start(h));
        const Vector edge = minus(at(surface_.start(Surface::next(h))), a);
        const double square = dot(edge, edge);
        if (!(square > 0.0)) continue;
        const Vector inward = minus(at(third(h)), a);
        const Vector away = minus(times(dot(inward, edge) / square, edge), inward);
        const double length = std::sqrt(dot(away, away));
        const Vector beyond = minus(at(third(other)), a);
        UnitVector crease;
        if (length > 0.0 && set_direction(dot(beyond, away) / length, dot(beyond, frame.z), crease)) {
            sum.cosine += crease.cosine;
            sum.sine += crease.sine;
        }
    }
    UnitVector mean;
    set_direction(sum.cosine, sum.sine, mean);
    return mean;
}

void BendingAngle::gather(const Gate& gate, const GateFrame& frame) {
    ++gathering_;
    gathered_.clear();
    waiting_.clear();
    const auto most = static_cast<std::size_t>(fit_.vertices);
    const auto take = [&](std::int32_t v) {
        std::int32_t& seen = vertex_seen_[static_cast<std::size_t>(v)];
        if (seen == gathering_) return;
        seen = gathering_;
        gathered_.push_back(local(v, frame));
    };
    for (const std::int32_t v : {gate.left, gate.right, gate.opposite}) take(v);
    const Vector* reference = normal_of(gate.triangle);
    if (!reference) return;
    triangle_seen_[static_cast<std::size_t>(gate.triangle)] = gathering_;
    for (std::int32_t h = 3 * gate.triangle; h < 3 * gate.triangle + 3; ++h) waiting_.push_back(h);
    // First in, first out, so that near vertices come first.
    for (std::size_t k = 0; k < waiting_.size() && k < kTrianglesAVertex * most && gathered_.size() < most;
         ++k) {
        const std::int32_t other = surface_.twin[static_cast<std::size_t>(waiting_[k])];
        if (other == kNone || triangle_seen_[static_cast<std::size_t>(other / 3)] == gathering_) continue;
        triangle_seen_[static_cast<std::size_t>(other / 3)] = gathering_;
        if (!is_decoded(other / 3)) continue;
        const Vector* normal = normal_of(other / 3);
        if (!normal || !(dot(*normal, *reference) > static_cast<double>(fit_.cosine))) continue;
        take(third(other));
        waiting_.push_back(Surface::next(other));
        waiting_.push_back(Surface::previous(other));
    }
}

double BendingAngle::weight(const Vector& p) const {
    const double square = dot(p, p);
    return square > 0.0 ? power(square, -0.5 * static_cast<double>(fit_.exponent)) : 0.0;
}

bool BendingAngle::predict_graph(double x, double radius, UnitVector& direction) {
    if (gathered_.size() < 4) return false;
    constexpr std::size_t kTerms = 6;  // 1, x, y, x x, x y, y y
    constexpr double kRidge = 1e-4;    // of a curvature that nothing but this speaks against
    Cholesky<kTerms>::Matrix matrix{};
    std::array<double, kTerms> solution{};
    double total = 0.0;
    const double scale = 1.0 / radius;
    for (const Vector& vertex : gathered_) {
        const Vector p = times(scale, vertex);
        const double w = weight(p);
        const std::array<double, kTerms> terms = {1.0, p[0], p[1], p[0] * p[0], p[0] * p[1], p[1] * p[1]};
        add_square<kTerms>(matrix, w, terms);
        for (std::size_t i = 0; i < kTerms; ++i) solution[i] += w * p[2] * terms[i];
        total += w;
    }
    Cholesky<kTerms> cholesky;
    if (!cholesky.factor(matrix, kRidge * total)) return false;
    cholesky.solve(solution);

    // z = a + b y + c y^2 on the circle y^2 + z^2 = 1.
    const double u = x * scale;
    const double a = solution[0] + u * (solution[1] + u * solution[3]);
    const double b = solution[2] + u * solution[4];
    const double c = solution[5];
    std::array<double, 4> roots;
    const int count =
        solve_quartic({a * a - 1.0, 2.0 * a * b, 1.0 + b * b + 2.0 * a * c, 2.0 * b * c, c * c}, roots);
    if (count == 0) return false;
    const double y = *std::max_element(roots.begin(), roots.begin() + count);  // the angle next to 0
    return set_direction(y, a + y * (b + y * c), direction);
}

bool BendingAngle::predict_implicit(double x, double radius, UnitVector& direction) {
    if (gathered_.size() < 4) return false;
    constexpr std::size_t kTerms = 10;  // 1, x, y, z, x x, x y, y y, y z, z z, z x
    constexpr std::size_t kHeight = 3;
    constexpr double kRidge = 1e-7;
    Cholesky<kTerms>::Matrix matrix{};
    double total = 0.0;
    const double scale = 1.0 / radius;
    for (const Vector& vertex : gathered_) {
        const Vector p = times(scale, vertex);
        const double w = weight(p);
        add_square<kTerms>(matrix, w,
                           {1.0, p[0], p[1], p[2], p[0] * p[0], p[0] * p[1], p[1] * p[1], p[1] * p[2],
                            p[2] * p[2], p[2] * p[0]});
        total += w;
    }
    // The eigenvector of the smallest eigenvalue by inverse iteration from the plane z = 0: where several
    // quadrics fit, the one next to the plane.
    Cholesky<kTerms> cholesky;
    if (!cholesky.factor(matrix, kRidge * total)) return false;
    std::array<double, kTerms> q{};
    q[kHeight] = 1.0;
    for (int step = 0; step < 3; ++step) {
        cholesky.solve(q);
        double square = 0.0;
        for (const double value : q) square += value * value;
        if (!(square > 0.0 && square < 1e200)) return false;
        const double inverse = 1.0 / std::sqrt(square);
        for (double& value : q) value *= inverse;
    }
    // On the circle, with t the tangent of half the angle.
    const double u = x * scale;
    const double one = q[0] + u * (q[1] + u * q[4]), cosine = q[2] + u * q[5], sine = q[3] + u * q[9];
    const double cosine2 = q[6], both = q[7], sine2 = q[8];
    std::array<double, 4> roots;
    const int count =
        solve_quartic({one + cosine + cosine2, 2.0 * (sine + both), 2.0 * (one - cosine2) + 4.0 * sine2,
                       2.0 * (sine - both), one - cosine + cosine2},
                      roots);
    if (count == 0) return false;
    const double t = *std::min_element(roots.begin(), roots.begin() + count,
                                       [](double l, double r) { return std::abs(l) < std::abs(r); });
    return set_direction(1.0 - t * t, 2.0 * t, direction);
}

bool BendingAngle::predict_sphere(const Gate& gate, const GateFrame& frame, double x, double radius,
                                  UnitVector& direction) {
    // The circle through the reference triangle, in its plane.
    const Vector corner = local(gate.opposite, frame);
    const double half = 0.5 * frame.length;
    if (!(corner[1] < 0.0)) return false;
    const double centre = (corner[0] * corner[0] + corner[1] * corner[1] - half * half) / (2.0 * corner[1]);
    const double square = half * half + centre * centre;
    const Vector* reference = normal_of(gate.triangle);
    if (!reference) return false;
    // Spheres through it and the corners beyond the other two edges: their centres' heights.
    double radii = 0.0, curvatures = 0.0;
    int count = 0;
    for (std::int32_t h = 3 * gate.triangle; h < 3 * gate.triangle + 3; ++h) {
        const std::int32_t other = surface_.twin[static_cast<std::size_t>(h)];
        if (other == kNone || !is_decoded(other / 3)) continue;
        const Vector* normal = normal_of(other / 3);
        if (!normal || !(dot(*normal, *reference) > static_cast<double>(fit_.cosine))) continue;
        const Vector q = local(third(other), frame);
        const double across = q[1] - centre;
        const double power_of_q = q[0] * q[0] + across * across + q[2] * q[2] - square;
        if (!(std::abs(q[2]) > 1e-9 * std::abs(power_of_q))) continue;  // as good as flat
        const double height = power_of_q / (2.0 * q[2]);
        const double r = std::sqrt(square + height * height);
        radii += r;
        curvatures += (height < 0.0 ? -1.0 : 1.0) / r;
        ++count;
    }
    if (count == 0) return false;
    const double r = radii / count;
    double height = std::sqrt(std::max(0.0, r * r - square));
    if (curvatures < 0.0) height = -height;
    // cosine * centre + sine * height = k on the circle.
    const double k = (x * x + radius * radius + centre * centre - square) / (2.0 * radius);
    const double norm = centre * centre + height * height;
    const double rest = norm - k * k;
    if (!(norm > 0.0 && rest >= 0.0)) return false;
    const double root = std::sqrt(rest);
    const double first = centre * k + std::abs(height) * root;  // the larger cosine of the two
    return set_direction(first, height * k - (height < 0.0 ? -1.0 : 1.0) * centre * root, direction);
}

}  // namespace batchenc
