#include "kernels/split_prediction.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <limits>
#include <vector>

namespace batchenc {
namespace {

using enum GeometryPredictor;

/// A strip of three triangles; the traversal's order is that of the vertices.
const std::vector<Triangle> kStrip = {{0, 1, 2}, {2, 1, 3}, {2, 3, 4}};
const std::vector<LatticePoint> kFlat = {
    {0, 0, 0}, {6400, 0, 0}, {3200, 6400, 0}, {9600, 6400, 0}, {6400, 12800, 0}};

class Strip {
 public:
    Strip(GeometryPredictor predictor, NormalPredictor normal)
        : traversal_(MeshTraversal::of(kStrip, 5)),
          surface_(Surface::of(traversal_.in_places(kStrip))),
          state_(traversal_, surface_, predictor, normal) {
        for (std::size_t k = 0; k < 5; ++k) EXPECT_EQ(traversal_.order[k], static_cast<std::int32_t>(k));
        state_.start(kFlat);
    }
    /// Records points without residuals until the vertex is next, and predicts it.
    SplitTarget predict(const std::vector<LatticePoint>& points, std::size_t vertex) {
        for (; next_ < vertex; ++next_) {
            state_.predict(next_);
            state_.record(next_, {}, points[next_]);
        }
        return state_.predict(vertex);
    }
    SplitPrediction& state() { return state_; }

 private:
    MeshTraversal traversal_;
    Surface surface_;
    SplitPrediction state_;
    std::size_t next_ = 0;
};

/// A quarter turn about the z axis, and away.
std::vector<LatticePoint> turned() {
    std::vector<LatticePoint> points;
    for (const LatticePoint& p : kFlat) points.push_back({640 - p[1], p[0], 64});
    return points;
}

TEST(SplitPrediction, HandWorkedPlacesOfAMovedStrip) {
    const auto points = turned();
    // The first vertex stays; the third moves as the middle of the first two.
    Strip strip(kLocalMultiway, NormalPredictor::kTime);
    EXPECT_EQ(strip.predict(points, 0).place, (std::array<double, 3>{0, 0, 0}));
    const auto third = strip.predict(points, 2).place;
    EXPECT_EQ(third, (std::array<double, 3>{3200 + 640 - 3200, 6400 + 3200, 64}));
    // What turns as one is found by local coordinates and by the affine frame, not by Lorenzo's
    // parallelogram.
    for (const GeometryPredictor predictor : {kLocalMultiway, kReplica}) {
        Strip other(predictor, NormalPredictor::kTime);
        for (const std::size_t v : {std::size_t{3}, std::size_t{4}}) {
            const SplitTarget target = other.predict(points, v);
            EXPECT_EQ(target.axes, SplitTarget::Axes::kLocal);
            for (std::size_t c = 0; c < 3; ++c)
                EXPECT_NEAR(target.place[c], points[v][c], 1e-6) << to_name(predictor);
        }
    }
    // Vertex 3: left 2, right 1, opposite 0, in some order; moved by those of 1 + 2 - 0, which is exact for
    // any affine motion of a parallelogram.
    for (const GeometryPredictor predictor : {kLorenzo, kLorenzoMultiway}) {
        Strip other(predictor, NormalPredictor::kTime);
        const SplitTarget target = other.predict(points, 3);
        for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(target.place[c], points[3][c], 1e-9);
    }
}

TEST(SplitPrediction, HandWorkedCircle) {
    // Vertex 3 over the gate (1, 2) and behind 0 lies at the parallelogram's corner, in the plane.
    const auto points = turned();
    for (const GeometryPredictor predictor :
         {kTime, kSpace, kSpaceMultiway, kSpaceTime, kSpaceTimeMultiway}) {
        for (const NormalPredictor normal :
             {NormalPredictor::kTime, NormalPredictor::kSpace, NormalPredictor::kSpaceTime}) {
            Strip strip(predictor, normal);
            const SplitTarget target = strip.predict(points, 3);
            ASSERT_EQ(target.axes, SplitTarget::Axes::kCircle);
            const double length = std::sqrt(3200.0 * 3200 + 6400.0 * 6400);
            EXPECT_NEAR(target.frame->length, length, 1e-9);
            // The gate's middle is (4800, 3200), 3 is (4800, 3200) from there: over a gate of direction
            // (1, -2) / sqrt(5) that is -1600 / sqrt(5) along and 12800 / sqrt(5) away.
            EXPECT_NEAR(std::abs(target.tangential[0]), 1600 / std::sqrt(5.0), 1e-6);
            EXPECT_NEAR(target.tangential[1], 12800 / std::sqrt(5.0), 1e-6);
            EXPECT_NEAR(target.bend.cosine, 1.0, 1e-9);
            EXPECT_EQ(strip.state().reconstruct(target, {0, 0, 0}), points[3]);
            // A step along, a step farther, and a step of arc out of the plane, as the radius then is.
            const LatticePoint moved = strip.state().reconstruct(target, {1, 1, 1});
            const double radius = 12800 / std::sqrt(5.0) + 64;
            const double rise = radius * std::sin(64.0 / radius);
            EXPECT_NEAR(std::abs(moved[2] - 64), rise, 0.51);
            const std::array<double, 3> place = {double(moved[0]), double(moved[1]), double(moved[2])};
            EXPECT_EQ(strip.state().residuals_of(target, place, 0.0), (std::array<std::int32_t, 3>{1, 1, 1}));
            // As far as the bound allows, smaller ones: two axes can go back, not the third.
            EXPECT_EQ(strip.state().residuals_of(target, place, 4.0), (std::array<std::int32_t, 3>{}));
        }
    }
}

TEST(SplitPrediction, TimeKeepsTheBendAndSpaceTakesThatOfTheCreases) {
    // The strip folded at the gate (1, 2) by a right angle: 3 stands over the plane of the first triangle.
    std::vector<LatticePoint> folded = kFlat;
    folded[3] = {4800 + 640, 3200 - 1280, 5724};
    Strip time(kTime, NormalPredictor::kTime);
    EXPECT_NEAR(time.predict(folded, 4).bend.cosine, 1.0, 1e-9) << "as it was flat before";
    Strip space(kTime, NormalPredictor::kSpace);
    const UnitVector bend = space.predict(folded, 4).bend;
    EXPECT_LT(bend.cosine, 0.5) << "as the crease at (1, 2)";
    Strip both(kTime, NormalPredictor::kSpaceTime);
    const UnitVector mean = both.predict(folded, 4).bend;
    EXPECT_NEAR(mean.cosine * mean.cosine + mean.sine * mean.sine, 1.0, 1e-12);
    EXPECT_NEAR(2 * std::atan2(mean.sine, mean.cosine), std::atan2(bend.sine, bend.cosine), 1e-9);
    // The next frame finds what this one had.
    time.state().record(4, {}, kFlat[4]);
    time.state().next_frame();
    for (std::size_t v = 0; v < 4; ++v) {
        time.state().predict(v);
        time.state().record(v, {}, folded[v]);
    }
    EXPECT_EQ(time.state().reconstruct(time.state().predict(4), {}), kFlat[4]);
}

TEST(SplitPrediction, ADegenerateGateFallsBackAndForgetsNothing) {
    std::vector<LatticePoint> collapsed(5, LatticePoint{100, 100, 100});
    for (const GeometryPredictor predictor : {kTime, kLocalMultiway, kReplica, kLorenzo}) {
        Strip strip(predictor, NormalPredictor::kSpace);
        const SplitTarget target = strip.predict(collapsed, 3);
        EXPECT_EQ(target.axes, SplitTarget::Axes::kWorld) << to_name(predictor);
        // Lorenzo: 3 moved as 1 + 2 - 0.
        EXPECT_EQ(target.place, (std::array<double, 3>{100, 100, 100}));
        for (const std::size_t v : {std::size_t{3}, std::size_t{4}}) {
            strip.state().predict(v);
            strip.state().record(v, {}, collapsed[v]);
        }
        strip.state().next_frame();
        if (predictor != kTime && predictor != kLocalMultiway) continue;
        for (std::size_t v = 0; v < 4; ++v) {
            const SplitTarget again = strip.state().predict(v);
            if (v == 3) {
                EXPECT_EQ(strip.state().reconstruct(again, {}), kFlat[3]) << to_name(predictor);
            }
            strip.state().record(v, {}, kFlat[v]);
        }
    }
}

TEST(SplitPrediction, ResidualsOfACorruptStreamLeadNowhereButStayOnTheLattice) {
    constexpr std::int32_t kMost = std::numeric_limits<std::int32_t>::max();
    for (const GeometryPredictor predictor : {kTime, kLocalMultiway}) {
        Strip strip(predictor, NormalPredictor::kTime);
        const SplitTarget target = strip.predict(kFlat, 3);
        for (const std::int32_t r : {kMost, -kMost}) {
            const LatticePoint point = strip.state().reconstruct(target, {r, r, r});
            for (const std::int32_t c : point) EXPECT_LE(std::abs(c), 1 << 29);
            strip.state().record(3, {r, r, r}, point);
            strip.state().predict(4);
        }
    }
}

}  // namespace
}  // namespace batchenc
