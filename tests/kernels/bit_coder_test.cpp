#include "kernels/bit_coder.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace batchenc {
namespace {

struct PlannedBit {
    bool bit;
    std::uint32_t one_probability;
};

std::vector<std::uint8_t> encode_all(const std::vector<PlannedBit>& plan) {
    BitCoder coder;
    for (const PlannedBit& p : plan) EXPECT_EQ(coder.code(p.bit, p.one_probability), p.bit);
    return coder.finish();
}

// How many bits come back before the first that does not, and what the end says.
struct Decoded {
    std::size_t same = 0;
    bool is_overrun = false, ends_well = false;
};
Decoded decode_all(std::span<const std::uint8_t> bytes, const std::vector<PlannedBit>& plan) {
    BitCoder coder(bytes);
    Decoded decoded;
    for (std::size_t i = 0; i < plan.size(); ++i) {
        const bool bit = coder.code(false, plan[i].one_probability);
        if (bit == plan[i].bit && decoded.same == i) ++decoded.same;
    }
    decoded.is_overrun = coder.is_overrun();
    decoded.ends_well = coder.check_end().has_value();
    return decoded;
}

void expect_round_trip(const std::vector<PlannedBit>& plan) {
    const auto bytes = encode_all(plan);
    const Decoded decoded = decode_all(bytes, plan);
    EXPECT_EQ(decoded.same, plan.size());
    EXPECT_FALSE(decoded.is_overrun);
    EXPECT_TRUE(decoded.ends_well);
}

bool draw_bit(std::mt19937& generator, std::uint32_t one_probability) {
    return generator() % 65536 < one_probability;
}

TEST(BitCoder, RoundTripsAtEveryProbability) {
    std::mt19937 generator(1);
    std::vector<PlannedBit> everything;
    for (const std::uint32_t stated : {1u, 2u, 255u, 256u, 4096u, 32767u, 32768u, 40000u, 65534u, 65535u}) {
        for (const std::uint32_t true_probability : {0u, 1u, 32768u, 65535u, 65536u}) {
            SCOPED_TRACE(std::to_string(stated) + " " + std::to_string(true_probability));
            std::vector<PlannedBit> plan;
            for (int i = 0; i < 3000; ++i) plan.push_back({draw_bit(generator, true_probability), stated});
            expect_round_trip(plan);
            everything.insert(everything.end(), plan.begin(), plan.end());
        }
    }
    expect_round_trip(everything);
}

TEST(BitCoder, RoundTripsEveryShortSequence) {
    for (const std::uint32_t probability : {1u, 300u, 32768u, 65535u}) {
        for (std::size_t length = 0; length <= 12; ++length) {
            for (std::uint32_t word = 0; word < 1u << length; ++word) {
                std::vector<PlannedBit> plan;
                for (std::size_t k = 0; k < length; ++k) plan.push_back({(word >> k & 1) != 0, probability});
                expect_round_trip(plan);
            }
        }
    }
}

// Ones alone keep the stream at zero, which is also what a decoder reads behind the end.
TEST(BitCoder, RoundTripsAnyNumberOfOnes) {
    for (const std::uint32_t probability : {1u, 32768u, 65000u, 65535u}) {
        for (std::size_t count = 0; count < 400; ++count)
            expect_round_trip(std::vector<PlannedBit>(count, {true, probability}));
    }
    std::mt19937 generator(2);
    std::vector<PlannedBit> plan;
    for (int i = 0; i < 100; ++i) plan.push_back({draw_bit(generator, 32768), 32768});
    for (int i = 0; i < 400; ++i) {
        plan.push_back({true, 32768});
        expect_round_trip(plan);
    }
}

TEST(BitCoder, CodesNoBitsAsNoBytes) {
    EXPECT_TRUE(encode_all({}).empty());
    EXPECT_TRUE(BitCoder(std::span<const std::uint8_t>()).check_end());
    for (const std::uint8_t byte : {std::uint8_t{0}, std::uint8_t{1}, std::uint8_t{255}}) {
        const std::vector<std::uint8_t> one = {byte};
        EXPECT_FALSE(BitCoder(one).check_end());
    }
}

TEST(BitCoder, ComesCloseToTheEntropy) {
    std::mt19937 generator(3);
    for (const std::uint32_t probability : {1u, 200u, 6554u, 32768u, 60000u}) {
        constexpr int kCount = 200000;
        std::vector<PlannedBit> plan;
        double entropy_bits = 0.0;
        for (int i = 0; i < kCount; ++i) {
            plan.push_back({draw_bit(generator, probability), probability});
            const double p = probability / 65536.0;
            entropy_bits -= std::log2(plan.back().bit ? p : 1.0 - p);
        }
        const double bits = 8.0 * static_cast<double>(encode_all(plan).size());
        EXPECT_GT(bits, entropy_bits - 1.0) << probability;
        EXPECT_LT(bits, 1.0005 * entropy_bits + 32.0) << probability;
    }
}

TEST(BitCoder, TellsEveryOtherStream) {
    std::mt19937 generator(4);
    for (int trial = 0; trial < 20; ++trial) {
        std::vector<PlannedBit> plan;
        for (int i = 0; i < 400; ++i) {
            const std::uint32_t probability = 1 + static_cast<std::uint32_t>(generator() % 65535);
            plan.push_back({draw_bit(generator, probability), probability});
        }
        const auto bytes = encode_all(plan);
        ASSERT_GT(bytes.size(), 20u);
        for (std::size_t size = 0; size < bytes.size(); ++size) {
            const Decoded decoded = decode_all(std::span(bytes).first(size), plan);
            ASSERT_FALSE(decoded.same == plan.size() && decoded.ends_well) << size;
            if (size + 5 <= bytes.size()) {
                ASSERT_TRUE(decoded.is_overrun) << size;
                ASSERT_FALSE(decoded.ends_well) << size;
            }
        }
        for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
            auto flipped = bytes;
            flipped[bit / 8] ^= static_cast<std::uint8_t>(1u << bit % 8);
            const Decoded decoded = decode_all(flipped, plan);
            ASSERT_FALSE(decoded.same == plan.size() && decoded.ends_well) << bit;
        }
        for (const int extra : {0, 1, 255}) {
            auto longer = bytes;
            for (int i = 0; i < 5; ++i) {
                longer.push_back(static_cast<std::uint8_t>(extra));
                const Decoded decoded = decode_all(longer, plan);
                ASSERT_FALSE(decoded.same == plan.size() && decoded.ends_well) << extra << " " << i;
            }
        }
    }
}

TEST(BitCoder, ReportsAnOverrunWhileDecoding) {
    const std::vector<std::uint8_t> bytes = {0x12, 0x34, 0x56};
    BitCoder coder(bytes);
    EXPECT_FALSE(coder.is_overrun());
    int bits = 0;
    for (; !coder.is_overrun() && bits < 1000; ++bits) coder.code(false, 1u << 15);
    EXPECT_GE(bits, 8 * 3);  // what is there was read first
    EXPECT_LE(bits, 8 * (3 + 1) + 1);
    EXPECT_EQ(coder.check_end().error().code, ErrorCode::kCorrupt);
}

TEST(BitCoder, FinishesToTheSameBytesTwice) {
    const std::vector<PlannedBit> plan = {{true, 7}, {false, 65535}, {true, 32768}, {false, 100}};
    EXPECT_EQ(encode_all(plan), encode_all(plan));
}

// e^0 = 1; e^1 = 2.7183 and e^4 = 54.598, worked out by hand: 65536 / (1 + e^-x).
TEST(Logistic, SquashesHandWorkedValues) {
    EXPECT_EQ(squash(0), 32768u);
    EXPECT_EQ(squash(256), 47911u);   // 0.7310586
    EXPECT_EQ(squash(-256), 17625u);  // 0.2689414
    EXPECT_EQ(squash(1024), 64357u);  // 0.9820138
    EXPECT_EQ(squash(-1024), 1179u);  // 0.0179862
    EXPECT_EQ(squash(-2560), 3u);     // 0.0000454
    EXPECT_EQ(squash(kLogisticLimit), 65535u);
    EXPECT_EQ(squash(-kLogisticLimit), 1u);
    EXPECT_EQ(squash(1000000), 65535u);
    EXPECT_EQ(squash(-1000000), 1u);
}

TEST(Logistic, StretchesHandWorkedValues) {
    EXPECT_EQ(stretch(2048), 1);    // the middle of the 4096th is just above a half
    EXPECT_EQ(stretch(3072), 282);  // ln 3 = 1.0986, 281.25 parts; the middle is above three quarters
    EXPECT_EQ(stretch(1024), -281);
    EXPECT_LT(stretch(0), -2200);  // ln(1 / 8191) = -9.01
    EXPECT_GT(stretch(4095), 2200);
}

TEST(Logistic, IsMonotoneAndItsOwnInverse) {
    for (int x = -kLogisticLimit - 3; x <= kLogisticLimit + 3; ++x) {
        ASSERT_LE(squash(x), squash(x + 1)) << x;
        ASSERT_NEAR(static_cast<double>(squash(x) + squash(-x)), 65536.0, 1.0) << x;
        const double limited = std::min(std::max(x, -kLogisticLimit), kLogisticLimit) / 256.0;
        ASSERT_NEAR(squash(x), 65536.0 / (1.0 + std::exp(-limited)), 0.501) << x;
    }
    for (std::uint32_t p = 0; p < 4096; ++p) {
        if (p > 0) {
            ASSERT_GE(stretch(p), stretch(p - 1)) << p;
        }
        ASSERT_GE(squash(stretch(p)), 16 * p + 8) << p;
        ASSERT_LT(squash(stretch(p) - 1), 16 * p + 8) << p;
    }
}

TEST(AdaptiveBit, LearnsTheMeanAndStaysInRange) {
    std::mt19937 generator(5);
    for (const std::uint32_t probability : {0u, 700u, 20000u, 50000u, 65536u}) {
        AdaptiveBit context;
        EXPECT_EQ(context.probability(), 32768u);
        EXPECT_EQ(context.probability12(), 2048u);
        for (int i = 0; i < 20000; ++i) {
            context.learn(draw_bit(generator, probability));
            ASSERT_LT(context.probability(), 65536u);
        }
        EXPECT_NEAR(context.probability(), probability, 2000.0);
    }
}

// Where contexts never tell and bits are one in sixteen, what is spent comes to their entropy.
double bits_of(const std::vector<bool>& bits, const std::vector<std::size_t>& told) {
    const auto run = [&](BitCoder& coder) {
        MixedBits mixed({2, 3}, 1);
        std::vector<bool> out;
        for (std::size_t i = 0; i < bits.size(); ++i)
            out.push_back(mixed.code(coder, !coder.is_decoder() && bits[i], {told[i], i % 3}, 0));
        return out;
    };
    BitCoder encoder;
    run(encoder);
    const auto bytes = encoder.finish();
    BitCoder decoder(bytes);
    EXPECT_EQ(run(decoder), bits);
    EXPECT_TRUE(decoder.check_end());
    return 8.0 * static_cast<double>(bytes.size()) / static_cast<double>(bits.size());
}

TEST(MixedBits, LearnWhichContextTells) {
    std::mt19937 generator(6);
    std::vector<bool> bits, fair;
    std::vector<std::size_t> nothing, everything;
    for (int i = 0; i < 20000; ++i) {
        bits.push_back(generator() % 16 == 0);
        fair.push_back(generator() % 2 == 0);
        nothing.push_back(0);
        everything.push_back(fair.back() ? 1 : 0);
    }
    EXPECT_NEAR(bits_of(bits, nothing), 0.337, 0.02);  // the entropy of one in sixteen
    EXPECT_NEAR(bits_of(fair, nothing), 1.0, 0.02);
    EXPECT_LT(bits_of(fair, everything), 0.01);  // the one context that tells wins
}

TEST(MixedBits, KeepSetsOfWeightsApart) {
    // In set 0 the context tells the bit, in set 1 its opposite; one set of weights could do neither.
    std::mt19937 generator(7);
    const auto spent = [&](std::size_t set_count) {
        BitCoder coder;
        MixedBits mixed({2}, set_count);
        for (int i = 0; i < 20000; ++i) {
            const bool bit = generator() % 2 == 0;
            const bool is_second = i % 5 == 4;
            mixed.code(coder, bit, {is_second != bit ? std::size_t{1} : 0}, is_second ? set_count - 1 : 0);
        }
        return 8.0 * static_cast<double>(coder.finish().size()) / 20000.0;
    };
    EXPECT_LT(spent(2), 0.9 * spent(1));
}

TEST(AdaptiveCount, RoundTripsEveryDigitCount) {
    std::vector<std::uint64_t> values;
    for (std::uint64_t v = 0; v < 300; ++v) values.push_back(v);
    for (int digits = 0; digits <= 40; ++digits) {
        for (const std::int64_t near : {-2, -1, 0, 1}) {
            const std::int64_t v = (std::int64_t{1} << digits) + near;
            if (v >= 0 && v < std::int64_t{1} << 40) values.push_back(static_cast<std::uint64_t>(v));
        }
    }
    ASSERT_EQ(values.back(), (std::uint64_t{1} << 40) - 1);
    std::mt19937_64 generator(8);
    for (int i = 0; i < 3000; ++i) values.push_back((generator() >> 24) >> (generator() % 40));
    BitCoder encoder;
    AdaptiveCount written;
    for (const std::uint64_t v : values) EXPECT_EQ(written.code(encoder, v), v);
    const auto bytes = encoder.finish();
    BitCoder decoder(bytes);
    AdaptiveCount read;
    for (const std::uint64_t v : values) ASSERT_EQ(read.code(decoder, 0), v);
    EXPECT_TRUE(decoder.check_end());
}

TEST(AdaptiveCount, SpendsLittleOnWhatReturns) {
    BitCoder coder;
    AdaptiveCount count;
    for (int i = 0; i < 10000; ++i) count.code(coder, 5);
    EXPECT_LT(coder.finish().size(), 40u);
}

TEST(AdaptiveCount, GivesBoundedValuesForAnyBytes) {
    std::mt19937 generator(9);
    for (int trial = 0; trial < 200; ++trial) {
        std::vector<std::uint8_t> bytes(20);
        for (auto& b : bytes) b = static_cast<std::uint8_t>(trial == 0 ? 0 : generator());
        BitCoder coder(bytes);
        AdaptiveCount count;
        for (int i = 0; i < 50; ++i) ASSERT_LT(count.code(coder, 0), std::uint64_t{1} << 41);
    }
}

TEST(AdaptiveNumber, RoundTripsAndLearns) {
    for (const std::uint32_t largest : {1u, 4u, 7u, 1000u}) {
        const auto pass = [largest](BitCoder coder) {
            AdaptiveNumber number(largest);
            for (std::uint32_t k = 0; k < 500; ++k) {
                const std::uint32_t value = k % 10 == 0 ? k % (largest + 1) : largest;
                EXPECT_EQ(number.code(coder, coder.is_decoder() ? 0 : value), value) << largest << " " << k;
            }
            if (coder.is_decoder()) {
                EXPECT_TRUE(coder.check_end().has_value());
            }
            return coder.is_decoder() ? std::vector<std::uint8_t>() : coder.finish();
        };
        const std::vector<std::uint8_t> bytes = pass(BitCoder());
        EXPECT_LT(bytes.size(), 250u);
        pass(BitCoder(bytes));
    }
}

}  // namespace
}  // namespace batchenc
