#include "kernels/quantizer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

namespace batchenc {
namespace {

TEST(MinMaxQuantizer, HandWorked) {
    const std::vector<float> values = {-1.0f, 0.0f, 0.5f, 3.0f};
    const auto quantizer = MinMaxQuantizer::of(values, 2);  // step (3 - -1) / 4 = 1
    EXPECT_EQ(quantizer.low, -1.0f);
    EXPECT_EQ(quantizer.step, 1.0f);
    EXPECT_EQ(quantizer.quantize(-1.0f, 2), 0);
    EXPECT_EQ(quantizer.quantize(0.0f, 2), 1);
    EXPECT_EQ(quantizer.quantize(0.5f, 2), 2) << "halves round up";
    EXPECT_EQ(quantizer.quantize(3.0f, 2), 4);
    EXPECT_EQ(quantizer.zero_level(2), 1);
    EXPECT_EQ(quantizer.dequantize(4), 3.0f);
}

TEST(MinMaxQuantizer, ErrorIsAtMostHalfAStep) {
    std::vector<float> values;
    for (int i = 0; i < 1000; ++i) values.push_back(static_cast<float>(std::sin(i) * 7.0 + 2.0));
    for (const int bits : {2, 8, 12, 16, 20}) {
        const auto quantizer = MinMaxQuantizer::of(values, bits);
        for (const float v : values) {
            EXPECT_NEAR(quantizer.dequantize(quantizer.quantize(v, bits)), v, 0.5 * quantizer.step + 2e-6);
        }
    }
}

TEST(MinMaxQuantizer, EqualValuesNeedNoLevels) {
    const std::vector<float> values(5, 42.0f);
    const auto quantizer = MinMaxQuantizer::of(values, 12);
    EXPECT_EQ(quantizer.step, 0.0f);
    EXPECT_EQ(quantizer.dequantize(quantizer.quantize(42.0f, 12)), 42.0f);
}

TEST(MinMaxQuantizer, SaysWhatItCannotHold) {
    const auto holds = [](std::vector<float> values) {
        return MinMaxQuantizer::of(values, 12).holds(values, 12);
    };
    EXPECT_TRUE(holds({-1.0f, 2.0f}));
    EXPECT_TRUE(holds({7.0f, 7.0f}));
    EXPECT_TRUE(holds({-1e38f, 1e38f}));
    EXPECT_FALSE(holds({-3.4e38f, 3.4e38f})) << "the range overflows";
    EXPECT_FALSE(holds({0.0f, 1e-45f})) << "the step is lost";
    EXPECT_FALSE(holds({0.0f, std::numeric_limits<float>::infinity()}));
}

TEST(MinMaxQuantizer, ZeroOutsideTheRangeTakesTheNearestEnd) {
    EXPECT_EQ(MinMaxQuantizer::of(std::vector<float>{5.0f, 6.0f}, 4).zero_level(4), 0);
    EXPECT_EQ(MinMaxQuantizer::of(std::vector<float>{-6.0f, -5.0f}, 4).zero_level(4), 16);
}

}  // namespace
}  // namespace batchenc
