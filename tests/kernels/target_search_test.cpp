#include "kernels/target_search.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace batchenc {
namespace {

/// A search over values of places, and where it measured.
struct Search {
    std::vector<std::int64_t> trials;

    std::int64_t run(std::int64_t count, double target, const EstimateValue& estimate,
                     const std::function<double(std::int64_t)>& value) {
        trials.clear();
        const auto place = last_within(count, target, estimate, [&](std::int64_t k) -> Expected<double> {
            EXPECT_GE(k, 0);
            EXPECT_LT(k, count);
            trials.push_back(k);
            return value(k);
        });
        EXPECT_TRUE(place);
        EXPECT_LE(trials.size(), static_cast<std::size_t>(kMostTrials));
        return place.value_or(-2);
    }
};

double as_is(std::int64_t k) { return static_cast<double>(k); }

TEST(TargetSearch, FindsThePlaceByARightEstimate) {
    Search search;
    const auto squares = [](std::int64_t k) { return as_is(k) * as_is(k); };
    EXPECT_EQ(search.run(100, 50.0, squares, squares), 7);
    EXPECT_LE(search.trials.size(), 5u);
    EXPECT_EQ(search.run(100, 1e9, squares, squares), 99);
    EXPECT_EQ(search.run(1, 0.0, squares, squares), 0);
    EXPECT_EQ(search.run(100, 0.5, squares, squares), 0);
}

TEST(TargetSearch, SaysWhereNothingIsWithin) {
    Search search;
    EXPECT_EQ(search.run(100, 4.0, as_is, [](std::int64_t k) { return as_is(k) + 5.0; }), -1);
    EXPECT_EQ(search.trials.front(), 0);
}

TEST(TargetSearch, LearnsTheFactorOfTheEstimate) {
    Search search;
    const auto value = [](std::int64_t k) { return 1.0 + 3.7 * std::pow(as_is(k), 1.3); };
    for (const double target : {1.5, 20.0, 1000.0, 20000.0}) {
        const std::int64_t place = search.run(5000, target, as_is, value);
        EXPECT_LE(value(place), target);
        EXPECT_GT(value(place + 1), 0.995 * target) << target;
        EXPECT_LE(search.trials.size(), 9u) << target;
    }
}

TEST(TargetSearch, StopsWhereItIsCloseEnough) {
    Search search;
    const auto value = [](std::int64_t k) { return as_is(k); };
    const std::int64_t place = search.run(100000, 50000.0, value, value);
    EXPECT_LE(search.trials.size(), 3u);
    EXPECT_LE(place, 50000);
    EXPECT_GE(place, 49750);
}

TEST(TargetSearch, GetsThereByHalvingWithAUselessEstimate) {
    Search search;
    for (const auto& estimate :
         {EstimateValue([](std::int64_t) { return 1.0; }), EstimateValue([](std::int64_t) { return 0.0; }),
          EstimateValue([](std::int64_t k) { return k < 900 ? 1e-9 : 1e9; })}) {
        for (const auto& [count, target] : {std::pair<std::int64_t, std::int64_t>{60, 41}, {200, 70}}) {
            const std::int64_t place = search.run(count, static_cast<double>(target), estimate, as_is);
            EXPECT_LE(place, target);
            EXPECT_GE(place, target - count / 10);
        }
    }
}

TEST(TargetSearch, IsNotLedAstrayByValuesThatFall) {
    Search search;
    const auto value = [](std::int64_t k) { return as_is(k) + (k % 7 == 3 ? -2.0 : 0.0); };
    const std::int64_t place = search.run(300, 100.0, as_is, value);
    EXPECT_LE(value(place), 100.0);
    EXPECT_GE(place, 95);
}

TEST(TargetSearch, PassesErrorsOn) {
    const auto found = last_within(10, 5.0, as_is, [](std::int64_t k) -> Expected<double> {
        if (k > 0) return fail(ErrorCode::kNumerical, "no");
        return 1.0;
    });
    ASSERT_FALSE(found);
    EXPECT_EQ(found.error().code, ErrorCode::kNumerical);
}

}  // namespace
}  // namespace batchenc
