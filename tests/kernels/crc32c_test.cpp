#include "kernels/crc32c.h"

#include <gtest/gtest.h>

#include <random>
#include <string_view>
#include <vector>

namespace batchenc {
namespace {

std::vector<std::uint8_t> random_bytes(std::size_t size, std::uint32_t seed) {
    std::mt19937 generator(seed);
    std::vector<std::uint8_t> bytes(size);
    for (auto& byte : bytes) byte = static_cast<std::uint8_t>(generator());
    return bytes;
}

// One bit at a time, as the definition has it.
std::uint32_t crc32c_by_definition(std::span<const std::uint8_t> bytes) {
    std::uint32_t state = 0xffffffff;
    for (const std::uint8_t byte : bytes) {
        state ^= byte;
        for (int bit = 0; bit < 8; ++bit) state = (state & 1) ? (state >> 1) ^ 0x82f63b78 : state >> 1;
    }
    return ~state;
}

TEST(Crc32c, GivesThePublishedValues) {
    const std::string_view digits = "123456789";
    const std::vector<std::uint8_t> text(digits.begin(), digits.end());
    const std::vector<std::uint8_t> zeros(32, 0x00), ones(32, 0xff);  // RFC 3720 B.4
    for (const auto function : {&crc32c, &crc32c_portable}) {
        EXPECT_EQ(function(text, 0), 0xE3069283u);
        EXPECT_EQ(function(zeros, 0), 0x8A9136AAu);
        EXPECT_EQ(function(ones, 0), 0x62A8AB43u);
        EXPECT_EQ(function({}, 0), 0u);
        EXPECT_EQ(function({}, 0x12345678), 0x12345678u);
    }
}

TEST(Crc32c, BothFormsFollowTheDefinitionForEveryLengthAndAlignment) {
    const auto bytes = random_bytes(200, 1);
    for (std::size_t begin = 0; begin < 9; ++begin) {
        for (std::size_t size = 0; begin + size <= bytes.size(); ++size) {
            const auto run = std::span(bytes).subspan(begin, size);
            const std::uint32_t expected = crc32c_by_definition(run);
            ASSERT_EQ(crc32c(run), expected) << begin << " " << size;
            ASSERT_EQ(crc32c_portable(run), expected) << begin << " " << size;
        }
    }
}

TEST(Crc32c, BothFormsAgreeAroundTheInterleavedStretches) {
    const auto bytes = random_bytes(40000, 2);
    for (const std::size_t size : {2047, 2048, 6143, 6144, 6145, 6151, 6152, 12287, 12288, 12297, 39999}) {
        const auto run = std::span(bytes).subspan(1, size);
        EXPECT_EQ(crc32c(run), crc32c_by_definition(run)) << size;
        EXPECT_EQ(crc32c_portable(run), crc32c(run)) << size;
    }
}

TEST(Crc32c, GoesOnFromASeed) {
    const auto bytes = random_bytes(20000, 3);
    const std::uint32_t whole = crc32c(bytes);
    for (const std::size_t cut : {0, 1, 7, 6144, 10000, 20000}) {
        EXPECT_EQ(crc32c(std::span(bytes).subspan(cut), crc32c(std::span(bytes).first(cut))), whole) << cut;
    }
}

}  // namespace
}  // namespace batchenc
