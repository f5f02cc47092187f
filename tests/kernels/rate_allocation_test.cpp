#include "kernels/rate_allocation.h"

#include <gtest/gtest.h>

namespace batchenc {
namespace {

using Points = std::vector<RatePoint>;
using Indices = std::vector<std::size_t>;

TEST(LowerHull, KeepsConvexPoints) {
    EXPECT_EQ(lower_hull(Points{{0, 100}}), (Indices{0}));
    EXPECT_EQ(lower_hull(Points{{0, 100}, {1, 40}, {2, 20}, {3, 12}}), (Indices{0, 1, 2, 3}));
}

TEST(LowerHull, LeavesOutWhatLiesAbove) {
    // From (0, 100): 10 a unit to the second, 40 a unit to the third, which therefore is the next.
    EXPECT_EQ(lower_hull(Points{{0, 100}, {1, 90}, {2, 20}, {3, 10}}), (Indices{0, 2, 3}));
    // Two in a row: 100 - 4 x 25 = 0 is below both.
    EXPECT_EQ(lower_hull(Points{{0, 100}, {1, 80}, {3, 60}, {4, 0}}), (Indices{0, 3}));
    // On one line: every point stays, since smaller steps hit a target better.
    EXPECT_EQ(lower_hull(Points{{0, 90}, {1, 60}, {2, 30}, {3, 0}}), (Indices{0, 1, 2, 3}));
}

TEST(LowerHull, EndsAtTheLeastDistortion) {
    EXPECT_EQ(lower_hull(Points{{0, 10}, {1, 4}, {2, 4}, {3, 5}}), (Indices{0, 1}));
    EXPECT_EQ(lower_hull(Points{{0, 10}, {1, 12}, {2, 4}, {3, 6}, {4, 3}}), (Indices{0, 2, 4}));
    EXPECT_EQ(lower_hull(Points{{0, 0}, {1, 0}, {2, 0}}), (Indices{0}));
}

// A quantiser that has to reach farther may make more components cheaper than fewer.
TEST(LowerHull, TakesPointsInAnyOrder) {
    EXPECT_EQ(lower_hull(Points{{0, 100}, {4, 20}, {2, 40}, {8, 4}, {6, 10}}), (Indices{0, 2, 1, 4, 3}));
    EXPECT_EQ(lower_hull(Points{{0, 100}, {2, 50}, {2, 40}, {2, 60}}), (Indices{0, 2}));
}

TEST(RateAllocation, TakesTheSteepestStepOfAllSources) {
    // Worked by hand: steps of the first source 30, 6 and 2 a unit, of the second 20 and 5, of the third
    // none.
    const std::vector<Points> sources = {
        {{0, 100}, {2, 40}, {3, 34}, {5, 30}}, {{0, 50}, {1, 30}, {3, 20}}, {{0, 7}}};
    const auto steps = steepest_first(sources);
    const std::vector<AllocationStep> expected = {
        {0, 1, 2, 60}, {1, 1, 1, 20}, {0, 2, 1, 6}, {1, 2, 2, 10}, {0, 3, 2, 4}};
    ASSERT_EQ(steps.size(), expected.size());
    for (std::size_t k = 0; k < steps.size(); ++k) {
        EXPECT_EQ(steps[k].source, expected[k].source) << k;
        EXPECT_EQ(steps[k].point, expected[k].point) << k;
        EXPECT_EQ(steps[k].rate, expected[k].rate) << k;
        EXPECT_EQ(steps[k].distortion, expected[k].distortion) << k;
    }
}

TEST(RateAllocation, StepsOverWhatIsNoUse) {
    const auto steps = steepest_first({{{0, 100}, {1, 99}, {2, 10}}, {{0, 100}, {1, 50}}});
    ASSERT_EQ(steps.size(), 2u);
    EXPECT_EQ(steps[0].source, 1);
    EXPECT_EQ(steps[1].source, 0);
    EXPECT_EQ(steps[1].point, 2) << "both components at once";
}

TEST(RateAllocation, EqualStepsGoBySource) {
    const Points line = {{0, 4}, {1, 2}, {2, 0}};
    const auto steps = steepest_first({line, line});
    ASSERT_EQ(steps.size(), 4u);
    EXPECT_EQ(steps[0].source, 0);
    EXPECT_EQ(steps[1].source, 0);
    EXPECT_EQ(steps[1].point, 2);
    EXPECT_EQ(steps[2].source, 1);
    EXPECT_TRUE(steepest_first({}).empty());
}

// No allocation of as little rate is better than what the first steps give: against all of them.
TEST(RateAllocation, IsTheBestOfAllAllocations) {
    std::uint32_t state = 1;
    const auto random = [&] { return static_cast<double>((state = state * 1664525u + 1013904223u) >> 24); };
    for (int round = 0; round < 50; ++round) {
        std::vector<Points> sources(3);
        for (Points& points : sources) {
            points.push_back({0, 1000 + random()});
            for (int l = 1; l < 5; ++l)
                points.push_back({points.back().rate + 1 + random(), points.back().distortion - random()});
        }
        std::vector<std::size_t> at(3);
        for (const AllocationStep& step : steepest_first(sources)) {
            at[static_cast<std::size_t>(step.source)] = static_cast<std::size_t>(step.point);
            double rate = 0, distortion = 0;
            for (std::size_t s = 0; s < 3; ++s) {
                rate += sources[s][at[s]].rate;
                distortion += sources[s][at[s]].distortion;
            }
            for (const RatePoint& a : sources[0])
                for (const RatePoint& b : sources[1])
                    for (const RatePoint& c : sources[2])
                        if (a.rate + b.rate + c.rate <= rate) {
                            EXPECT_GE(a.distortion + b.distortion + c.distortion, distortion - 1e-9);
                        }
        }
    }
}

}  // namespace
}  // namespace batchenc
