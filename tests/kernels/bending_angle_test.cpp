#include "kernels/bending_angle.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <vector>

#include "kernels/vector3.h"

namespace batchenc {
namespace {

using Vector = std::array<double, 3>;
using Height = std::function<double(double, double)>;

/// A grid over a surface of which all is decoded but the vertex in the middle, which stands behind a gate.
class Patch {
 public:
    static constexpr std::int32_t kSide = 9;
    static constexpr double kCell = 4000.0;  // lattice units: quantisation does not matter
    static constexpr std::int32_t kTarget = (kSide / 2) * kSide + kSide / 2;

    explicit Patch(const Height& height) {
        for (std::int32_t y = 0; y + 1 < kSide; ++y) {
            for (std::int32_t x = 0; x + 1 < kSide; ++x) {
                const std::int32_t v = kSide * y + x;
                triangles_.push_back({v, v + 1, v + kSide + 1});
                triangles_.push_back({v, v + kSide + 1, v + kSide});
            }
        }
        for (std::int32_t v = 0; v < kSide * kSide; ++v) {
            const double x = (v % kSide - kSide / 2) * kCell, y = (v / kSide - kSide / 2) * kCell;
            points_.push_back({static_cast<std::int32_t>(std::lround(x)),
                               static_cast<std::int32_t>(std::lround(y)),
                               static_cast<std::int32_t>(std::lround(height(x, y)))});
        }
        surface_ = Surface::of(triangles_);
    }

    /// Between the predicted and the true angle, radians. row: as many rows of the grid are decoded before
    /// the target's.
    double error(GeometryPredictor predictor, NormalFit fit = {}, bool only_reference = false) {
        BendingAngle bending(surface_, own_fit(fit, predictor), predictor, points_.size());
        // The gate below and to the left of the target: its triangle {v, v + 1, v + kSide + 1} shares the
        // edge to the one above.
        const Gate gate = {kTarget - kSide, kTarget - kSide - 1, kTarget - 2 * kSide - 1, reference()};
        for (std::int32_t v = 0; v < kSide * kSide; ++v) {
            const bool is_corner = v == gate.left || v == gate.right || v == gate.opposite;
            if (is_corner || (!only_reference && v < kTarget))
                bending.add(static_cast<std::size_t>(v), points_[static_cast<std::size_t>(v)]);
        }
        const Vector left = at(gate.left), right = at(gate.right);
        GateFrame frame;
        frame.origin = times(0.5, plus(left, right));
        const Vector along = minus(right, left);
        frame.length = std::sqrt(dot(along, along));
        frame.x = times(1.0 / frame.length, along);
        const Vector away = minus(frame.origin, at(gate.opposite));
        const Vector across = minus(away, times(dot(away, frame.x), frame.x));
        frame.y = times(1.0 / std::sqrt(dot(across, across)), across);
        frame.z = cross(frame.x, frame.y);
        const Vector target = minus(at(kTarget), frame.origin);
        const double y = dot(target, frame.y), z = dot(target, frame.z);
        const UnitVector direction =
            bending.predict(gate, frame, dot(target, frame.x), std::sqrt(y * y + z * z));
        EXPECT_NEAR(direction.cosine * direction.cosine + direction.sine * direction.sine, 1.0, 1e-12);
        EXPECT_EQ(bending.asked(), 1);
        fell_back = bending.fell_back() == 1;
        return std::abs(std::atan2(direction.sine, direction.cosine) - std::atan2(z, y));
    }

    bool fell_back = false;

 private:
    Vector at(std::int32_t v) const {
        const LatticePoint& p = points_[static_cast<std::size_t>(v)];
        return {static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])};
    }
    std::int32_t reference() const {
        for (std::size_t t = 0; t < triangles_.size(); ++t) {
            if (triangles_[t] == Triangle{kTarget - 2 * kSide - 1, kTarget - kSide, kTarget - kSide - 1})
                return static_cast<std::int32_t>(t);
        }
        ADD_FAILURE() << "no reference triangle";
        return 0;
    }

    std::vector<Triangle> triangles_;
    std::vector<LatticePoint> points_;
    Surface surface_;
};

constexpr GeometryPredictor kAll[] = {GeometryPredictor::kToumaGotsman, GeometryPredictor::kHope,
                                      GeometryPredictor::kHopi, GeometryPredictor::kHops};

double sphere(double x, double y) {
    constexpr double kRadius = 60000.0;
    return std::sqrt(kRadius * kRadius - x * x - y * y);
}

TEST(BendingAngle, APlaneGoesOn) {
    for (const GeometryPredictor predictor : kAll)
        EXPECT_LT(Patch([](double x, double y) { return 0.3 * x - 0.2 * y; }).error(predictor), 1e-3)
            << to_name(predictor);
}

TEST(BendingAngle, ASphereIsFollowed) {
    Patch patch(sphere);
    const double creases = patch.error(GeometryPredictor::kToumaGotsman);
    EXPECT_GT(creases, 2e-3) << "neighbouring creases are not the same on this grid";
    EXPECT_LT(patch.error(GeometryPredictor::kHope), 0.5 * creases);
    EXPECT_FALSE(patch.fell_back);
    EXPECT_LT(patch.error(GeometryPredictor::kHopi, {40, 1.3f, 0.5f}), 1e-3) << "a quadric: exact";
    EXPECT_LT(patch.error(GeometryPredictor::kHops), 1e-3) << "a sphere: exact";
    EXPECT_FALSE(patch.fell_back);
}

TEST(BendingAngle, AParabolaIsFollowed) {
    const Height parabola = [](double x, double y) { return 4e-6 * (x * x - 2.0 * x * y + 3.0 * y * y); };
    Patch patch(parabola);
    const double creases = patch.error(GeometryPredictor::kToumaGotsman);
    EXPECT_LT(patch.error(GeometryPredictor::kHope), 0.2 * creases);
    EXPECT_LT(patch.error(GeometryPredictor::kHopi, {40, 1.3f, 0.5f}), 0.2 * creases);
}

TEST(BendingAngle, FallsBackWhereNothingCanBeFitted) {
    Patch patch(sphere);
    const double plane = patch.error(GeometryPredictor::kToumaGotsman, {}, true);
    EXPECT_GT(plane, 0.01) << "no crease is known, so the plane goes on, and the sphere does not";
    for (const GeometryPredictor predictor :
         {GeometryPredictor::kHope, GeometryPredictor::kHopi, GeometryPredictor::kHops}) {
        EXPECT_EQ(patch.error(predictor, {}, true), plane) << to_name(predictor);
        EXPECT_TRUE(patch.fell_back) << to_name(predictor);
    }
}

TEST(BendingAngle, VerticesBeyondASharpEdgeDoNotCount) {
    // A roof whose ridge is two rows before the gate: with them the fitted surface bends, without them it is
    // the plane.
    Patch patch([](double, double y) { return -0.5 * std::abs(y + 2.0 * Patch::kCell); });
    EXPECT_LT(patch.error(GeometryPredictor::kHope, {18, 1.3f, 0.9f}), 1e-3);
    EXPECT_GT(patch.error(GeometryPredictor::kHope, {64, 0.0f, 0.0f}), 0.02);
}

}  // namespace
}  // namespace batchenc
