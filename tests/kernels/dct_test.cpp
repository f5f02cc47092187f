#include "kernels/dct.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "kernels/byte_stream.h"
#include "kernels/crc32c.h"

namespace batchenc {
namespace {

constexpr double kPi = 3.14159265358979323846;

/// The definition, in double precision.
std::vector<double> direct(const std::vector<float>& rows, std::int64_t n, std::int64_t lane) {
    std::vector<double> spectrum(static_cast<std::size_t>(n));
    for (std::int64_t k = 0; k < n; ++k) {
        double sum = 0.0;
        for (std::int64_t i = 0; i < n; ++i) {
            const double angle =
                kPi * static_cast<double>(k * (2 * i + 1) % (4 * n)) / static_cast<double>(2 * n);
            sum +=
                static_cast<double>(rows[static_cast<std::size_t>(i * kDctLanes + lane)]) * std::cos(angle);
        }
        spectrum[static_cast<std::size_t>(k)] =
            sum * std::sqrt((k == 0 ? 1.0 : 2.0) / static_cast<double>(n));
    }
    return spectrum;
}

std::vector<float> random_rows(std::int64_t n) {
    std::mt19937 random(static_cast<std::uint32_t>(n));
    std::uniform_real_distribution<float> uniform(-1.0f, 1.0f);
    std::vector<float> rows(static_cast<std::size_t>(n * kDctLanes));
    for (float& value : rows) value = uniform(random);
    return rows;
}

class DctOfLength : public testing::TestWithParam<std::int64_t> {};

TEST_P(DctOfLength, AgreesWithTheDefinitionAndComesBack) {
    const std::int64_t n = GetParam();
    const Dct dct(n);
    const std::vector<float> rows = random_rows(n);
    std::vector<float> workspace(static_cast<std::size_t>(dct.workspace_size()));
    std::vector<float> values = rows;
    dct.forward(values.data(), workspace.data());
    for (const std::int64_t lane : {0, 5, 8, 15}) {
        const std::vector<double> expected = direct(rows, n, lane);
        for (std::int64_t k = 0; k < n; ++k)
            ASSERT_NEAR(values[static_cast<std::size_t>(k * kDctLanes + lane)],
                        expected[static_cast<std::size_t>(k)], 4e-6)
                << "coefficient " << k << ", lane " << lane;
    }
    dct.inverse(values.data(), workspace.data());
    for (std::size_t i = 0; i < rows.size(); ++i) ASSERT_NEAR(values[i], rows[i], 4e-6) << "sample " << i;
}

// One, primes with butterflies, 47 and beyond by the chirp, products of all.
INSTANTIATE_TEST_SUITE_P(Lengths, DctOfLength,
                         testing::Values(1, 2, 3, 4, 5, 6, 7, 8, 9, 12, 13, 16, 25, 30, 37, 43, 47, 49, 94,
                                         97, 100, 128, 210, 353, 360, 1009, 1024, 43 * 43, 2310));

TEST(Dct, KnowsAConstantAndACosine) {
    const std::int64_t n = 6;
    const Dct dct(n);
    std::vector<float> values(static_cast<std::size_t>(n * kDctLanes), 0.0f);
    std::vector<float> workspace(static_cast<std::size_t>(dct.workspace_size()));
    for (std::int64_t i = 0; i < n; ++i) {
        values[static_cast<std::size_t>(i * kDctLanes)] = 2.0f;
        values[static_cast<std::size_t>(i * kDctLanes + 9)] =
            static_cast<float>(std::cos(kPi * 2.0 * (2.0 * static_cast<double>(i) + 1.0) / 12.0));
    }
    dct.forward(values.data(), workspace.data());
    EXPECT_NEAR(values[0], 2.0 * std::sqrt(6.0), 1e-6);
    EXPECT_NEAR(values[2 * kDctLanes + 9], std::sqrt(3.0), 1e-6);  // sqrt(2/6) * 6/2
    for (std::int64_t k = 0; k < n; ++k) {
        const auto row = static_cast<std::size_t>(k * kDctLanes);
        EXPECT_NEAR(k == 0 ? 0.0f : values[row], 0.0, 1e-6);
        EXPECT_NEAR(k == 2 ? 0.0f : values[row + 9], 0.0, 1e-6);
    }
}

TEST(Dct, LanesDoNotSeeEachOther) {
    const std::int64_t n = 53;
    const Dct dct(n);
    std::vector<float> workspace(static_cast<std::size_t>(dct.workspace_size()));
    const std::vector<float> rows = random_rows(n);
    for (std::int64_t lane = 0; lane < kDctLanes / 2; ++lane) {
        // Two signals share a complex transform: with its partner kept, a lane's result is the same to the
        // bit.
        std::vector<float> all = rows, few(rows.size(), 0.0f);
        for (std::int64_t i = 0; i < n; ++i)
            for (const std::int64_t kept : {lane, lane + kDctLanes / 2})
                few[static_cast<std::size_t>(i * kDctLanes + kept)] =
                    rows[static_cast<std::size_t>(i * kDctLanes + kept)];
        dct.forward(all.data(), workspace.data());
        dct.forward(few.data(), workspace.data());
        for (std::int64_t k = 0; k < n; ++k)
            ASSERT_EQ(all[static_cast<std::size_t>(k * kDctLanes + lane)],
                      few[static_cast<std::size_t>(k * kDctLanes + lane)]);
    }
}

// The order of points hangs on these bits (docs/FORMAT.md, which has the number too).
TEST(Dct, InverseOfOneSignalIsTheSameBitsEverywhere) {
    ByteWriter out;
    for (std::int64_t n = 1; n <= 130; ++n) {
        const Dct dct(n);
        std::vector<float> values(static_cast<std::size_t>(n * kDctLanes), 0.0f);
        std::vector<float> workspace(static_cast<std::size_t>(dct.workspace_size()));
        for (std::int64_t k = 0; k < n; ++k)
            values[static_cast<std::size_t>(k * kDctLanes)] =
                static_cast<float>((k * k + 3 * k + n) % 29 - 14);
        dct.inverse(values.data(), workspace.data());
        for (std::int64_t i = 0; i < n; ++i)
            out.put(values[static_cast<std::size_t>(i * kDctLanes)] + 0.0f);  // -0 becomes 0
    }
    EXPECT_EQ(crc32c(out.take()), 0x71e4f45au);
}

}  // namespace
}  // namespace batchenc
