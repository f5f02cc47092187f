#include "kernels/temporal_series.h"

#include <gtest/gtest.h>

#include <vector>

namespace batchenc {
namespace {

TEST(TemporalSeries, PredictsPolynomialsExactly) {
    const std::vector<std::int32_t> constant = {7, 7, 7, 7, 7}, line = {1, 4, 7, 10, 13},
                                    parabola = {0, 1, 4, 9, 16, 25};
    for (std::int64_t t = 1; t < 5; ++t) EXPECT_EQ(predict_temporal(constant.data(), t, 1), 7);
    for (std::int64_t t = 2; t < 5; ++t)
        EXPECT_EQ(predict_temporal(line.data(), t, 2), line[static_cast<std::size_t>(t)]);
    for (std::int64_t t = 3; t < 6; ++t)
        EXPECT_EQ(predict_temporal(parabola.data(), t, 3), parabola[static_cast<std::size_t>(t)]);
}

TEST(TemporalSeries, UsesWhatPastThereIs) {
    const std::vector<std::int32_t> series = {10, 20, 40};
    EXPECT_EQ(predict_temporal(series.data(), 0, 3), 0);
    EXPECT_EQ(predict_temporal(series.data(), 1, 3), 10);
    EXPECT_EQ(predict_temporal(series.data(), 2, 3), 30);
}

TEST(TemporalSeries, ChoosesTheOrderThatFits) {
    std::vector<std::int32_t> noise, steps, line, parabola;
    for (std::int32_t i = 0; i < 50; ++i) {
        noise.push_back((i * 7919) % 13 - 6);
        steps.push_back(100 * (i / 10));
        line.push_back(5 * i);
        parabola.push_back(i * i);
    }
    EXPECT_EQ(choose_temporal_order(noise).order, 0);
    EXPECT_EQ(choose_temporal_order(steps).order, 1);
    EXPECT_EQ(choose_temporal_order(line).order, 2);
    EXPECT_EQ(choose_temporal_order(parabola).order, 3);
    EXPECT_EQ(choose_temporal_order(line).mean_magnitude, 0.0);
    EXPECT_EQ(choose_temporal_order({}).order, 0);
    EXPECT_EQ(choose_temporal_order(std::vector<std::int32_t>{5}).order, 0);
}

}  // namespace
}  // namespace batchenc
