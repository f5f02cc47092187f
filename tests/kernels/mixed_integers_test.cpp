#include "kernels/mixed_integers.h"

#include <gtest/gtest.h>

#include <random>

namespace batchenc {
namespace {

struct Planned {
    std::int32_t value;
    std::vector<std::size_t> contexts;
};

std::vector<std::uint8_t> encode_all(std::initializer_list<std::size_t> counts,
                                     const std::vector<Planned>& plan) {
    BitCoder coder;
    MixedIntegers integers(counts);
    for (const Planned& p : plan) EXPECT_EQ(integers.code(coder, p.value, p.contexts), p.value);
    return coder.finish();
}

void expect_round_trip(std::initializer_list<std::size_t> counts, const std::vector<Planned>& plan) {
    const auto bytes = encode_all(counts, plan);
    BitCoder coder(bytes);
    MixedIntegers integers(counts);
    for (std::size_t i = 0; i < plan.size(); ++i)
        ASSERT_EQ(integers.code(coder, 12345, plan[i].contexts), plan[i].value) << "integer " << i;
    EXPECT_FALSE(coder.is_overrun());
    EXPECT_TRUE(coder.check_end());
}

TEST(MixedIntegers, RoundTripsExtremes) {
    std::vector<Planned> plan;
    for (const std::int32_t magnitude :
         {0, 1, 2, 3, 4, 7, 8, 255, 256, (1 << 29) - 1, 1 << 29, (1 << 30) - 1, 1 << 30}) {
        for (const std::int32_t sign : {1, -1}) plan.push_back({sign * magnitude, {0}});
    }
    const std::vector<Planned> once = plan;
    for (int round = 0; round < 20; ++round) plan.insert(plan.end(), once.begin(), once.end());
    expect_round_trip({1}, plan);
    for (const Planned& p : once) expect_round_trip({1}, {p});
    expect_round_trip({1}, {});
}

TEST(MixedIntegers, RoundTripsRandomIntegersUnderAnyContexts) {
    std::mt19937 random(3);
    std::vector<Planned> plan;
    for (int i = 0; i < 20000; ++i) {
        const std::int32_t largest = std::int32_t{1} << random() % 31;
        const auto value =
            static_cast<std::int32_t>(random() % (2u * static_cast<std::uint32_t>(largest))) - largest;
        plan.push_back({value, {random() % 5, random() % 100, random() % 2, 0}});
    }
    expect_round_trip({5, 100, 2, 1}, plan);
}

// Uniform digits cost what they hold; what a context tells costs next to nothing, but for digits beyond
// three.
TEST(MixedIntegers, CostIsNearTheEntropy) {
    std::mt19937 random(5);
    std::vector<Planned> uniform, told, silent;
    for (int i = 0; i < 20000; ++i) {
        uniform.push_back({static_cast<std::int32_t>(random() % 1024) + 1024, {0, 0}});
        const std::size_t which = random() % 3;
        const auto value = static_cast<std::int32_t>(which) * 5 - 5;
        told.push_back({value, {which, 0}});
        silent.push_back({value, {0, 0}});
    }
    EXPECT_NEAR(static_cast<double>(encode_all({3, 1}, uniform).size()), 20000 * 10 / 8, 300);
    EXPECT_LT(encode_all({3, 1}, told).size(), 600u);
    EXPECT_NEAR(static_cast<double>(encode_all({3, 1}, silent).size()), 20000 * 1.585 / 8, 200);
}

TEST(MixedIntegers, AnyBytesGiveIntegersAndAnEnd) {
    std::mt19937 random(7);
    std::vector<std::uint8_t> bytes(2000);

    for (auto& b : bytes) b = static_cast<std::uint8_t>(random());
    for (const bool ones : {false, true}) {
        if (ones) bytes.assign(8, 0xff);  // zeros, of which a bit holds tens of thousands
        BitCoder coder(bytes);
        MixedIntegers integers{4, 4};
        int coded = 0;
        while (!coder.is_overrun() && coded < 50000000) {
            const std::int32_t value =
                integers.code(coder, 0, std::array<std::size_t, 2>{static_cast<std::size_t>(coded % 4), 3});
            ASSERT_NE(value, std::numeric_limits<std::int32_t>::min());
            ++coded;
        }
        EXPECT_TRUE(coder.is_overrun());
    }
}

}  // namespace
}  // namespace batchenc
