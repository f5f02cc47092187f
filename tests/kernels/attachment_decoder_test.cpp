#include "kernels/attachment_decoder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>
#include <string>

#include "kernels/range_coder.h"
#include "tests/support/sample_meshes.h"

namespace batchenc {
namespace {

#include "golden_attachments.inc"

constexpr std::int32_t kLast = std::numeric_limits<std::int32_t>::max() - 1;

struct Golden {
    const std::vector<std::uint8_t>& bytes;
    std::int64_t vertex_count;
    std::vector<Triangle> triangles;
};

// What the encoder was given for the streams in the file of golden ones, in their order.
std::vector<Golden> goldens() {
    std::mt19937 of_grid(8), of_triangles(9);
    auto grid = test::grid(8, 8);
    test::shuffle(grid, of_grid);
    test::rotate_corners(grid, of_grid);
    test::rename_vertices(grid, 64, of_grid);
    return {
        {kGoldenSmall, 70001, {{0, 1, 2}, {0, 2, 3}, {4, 3, 2}, {2, 1, 5}, {9, 70000, 8}, {8, 70000, 6}}},
        {kGoldenShuffledGrid, 64, grid},
        {kGoldenGrid, 64, test::grid(8, 8)},
        {kGoldenRandom, 10, test::random_triangles(60, 10, of_triangles)},
        {kGoldenLargestIndices,
         std::int64_t{kLast} + 1,
         {{0, kLast, 0},
          {kLast, 0, kLast - 1},
          {kLast, kLast - 1, 7},
          {0, 1, 2},
          {kLast, kLast, kLast},
          {kLast - 1, kLast, 5}}},
        {kGoldenFree, 61, {{0, 1, 2}, {0, 50, 60}}},
        {kGoldenThirdByDistance, 61, {{0, 1, 2}, {2, 1, 60}}},
        {kGoldenThirdAsNext, 5, {{0, 1, 2}, {2, 1, 3}, {2, 3, 4}}},
        {kGoldenFirstTriangle, 61, {{0, 1, 60}, {2, 3, 4}, {60, 1, 5}}},
    };
}

std::int64_t count_of(const Golden& golden) { return static_cast<std::int64_t>(golden.triangles.size()); }

TEST(AttachmentDecoder, StillReadsWhatItsEncoderWrote) {
    for (const Golden& golden : goldens()) {
        const auto decoded = decode_attachments(golden.bytes, count_of(golden), golden.vertex_count);
        ASSERT_TRUE(decoded) << decoded.error().to_string();
        EXPECT_EQ(*decoded, golden.triangles);
    }
}

TEST(AttachmentDecoder, DecodesNothingFromNothing) {
    const auto decoded = decode_attachments({}, 0, 10);
    ASSERT_TRUE(decoded);
    EXPECT_TRUE(decoded->empty());
    const std::vector<std::uint8_t> one_byte = {0};
    EXPECT_FALSE(decode_attachments(one_byte, 0, 10));
    EXPECT_FALSE(decode_attachments({}, 1, 10));
}

TEST(AttachmentDecoder, RejectsEveryTruncationExtraBytesAndOtherCounts) {
    for (const Golden& golden : goldens()) {
        const std::int64_t count = count_of(golden);
        for (std::size_t size = 0; size < golden.bytes.size(); ++size) {
            const std::vector<std::uint8_t> cut(golden.bytes.begin(),
                                                golden.bytes.begin() + static_cast<std::ptrdiff_t>(size));
            const auto decoded = decode_attachments(cut, count, golden.vertex_count);
            ASSERT_FALSE(decoded) << size;
            ASSERT_EQ(decoded.error().code, ErrorCode::kCorrupt);
        }
        auto longer = golden.bytes;
        longer.push_back(0);
        EXPECT_FALSE(decode_attachments(longer, count, golden.vertex_count));
        EXPECT_FALSE(decode_attachments(golden.bytes, count - 1, golden.vertex_count));
        EXPECT_FALSE(decode_attachments(golden.bytes, count + 1, golden.vertex_count));
    }
}

TEST(AttachmentDecoder, RejectsCountsThatTheBytesCannotHold) {
    const std::vector<std::uint8_t> bytes(8);
    for (const std::int64_t count : {std::int64_t{-1}, static_cast<std::int64_t>(max_symbol_count(8)),
                                     std::numeric_limits<std::int64_t>::max()}) {
        const auto decoded = decode_attachments(bytes, count, 10);
        ASSERT_FALSE(decoded);
        EXPECT_EQ(decoded.error().code, ErrorCode::kCorrupt);
    }
    EXPECT_EQ(decode_attachments(bytes, 1, std::int64_t{1} << 31).error().code, ErrorCode::kCorrupt);
    EXPECT_EQ(decode_attachments(bytes, 1, -1).error().code, ErrorCode::kCorrupt);
}

// A whole and sound stream, but for a mesh that has more vertices than the header says.
TEST(AttachmentDecoder, RejectsIndicesThatTheHeaderRulesOut) {
    for (const Golden& golden : goldens()) {
        std::int32_t largest = 0;
        for (const Triangle& t : golden.triangles)
            largest = std::max(largest, *std::max_element(t.begin(), t.end()));
        ASSERT_EQ(largest, golden.vertex_count - 1);
        for (const std::int32_t vertex_count : {largest, largest - 1, 1, 0}) {
            const auto decoded = decode_attachments(golden.bytes, count_of(golden), vertex_count);
            ASSERT_FALSE(decoded) << largest << " " << vertex_count;
            EXPECT_EQ(decoded.error().code, ErrorCode::kCorrupt);
        }
    }
}

// Sound streams of symbols, each in a context met for the first time, that no encoder made.
TEST(AttachmentDecoder, RejectsSymbolsThatNoEncoderMade) {
    constexpr std::int32_t kLowest = std::numeric_limits<std::int32_t>::min();
    const std::vector<std::vector<std::int32_t>> streams = {
        {2, 0},          // attached to the youngest gate before there is one
        {15, 0},         // to the oldest
        {16},            // no attachment at all: too large, too small, smallest
        {-17},           //
        {kLowest},       //
        {0, 1, 0},       // anchored at vertex 0, which no open edge leaves
        {-2, 1, 1, 12},  // free, its last index out of range
        {-2, -1, 1, 1},  // free, its first index negative
        {-2, 0, std::numeric_limits<std::int32_t>::max(), 0, 1, 1},  // free, its first index far out of range
        {-2, 0, kLowest, kLowest, 1, 1},
    };
    for (std::size_t i = 0; i < streams.size(); ++i) {
        RangeEncoder coder;
        for (const std::int32_t symbol : streams[i]) {
            IntegerModel fresh;
            coder.encode(fresh, symbol);
        }
        const auto decoded = decode_attachments(coder.finish(), 1, 10);
        ASSERT_FALSE(decoded) << i;
        EXPECT_EQ(decoded.error().code, ErrorCode::kCorrupt);
        EXPECT_NE(decoded.error().message.find("triangle 0"), std::string::npos)
            << decoded.error().to_string();
    }
    // The same way a stream that is one: free, {0, 0, 0}.
    RangeEncoder coder;
    for (const std::int32_t symbol : {-2, 1, 1, 1}) {
        IntegerModel fresh;
        coder.encode(fresh, symbol);
    }
    const auto decoded = decode_attachments(coder.finish(), 1, 10);
    ASSERT_TRUE(decoded) << decoded.error().to_string();
    EXPECT_EQ(*decoded, (std::vector<Triangle>{{0, 0, 0}}));
}

TEST(AttachmentDecoder, SurvivesDamageWithoutAnIndexOutOfRange) {
    std::mt19937 generator(4);
    int decoded_count = 0;
    for (const Golden& golden : goldens()) {
        for (int trial = 0; trial < 500; ++trial) {
            auto damaged = golden.bytes;
            for (unsigned flips = generator() % 4 + 1; flips > 0; --flips) {
                damaged[generator() % damaged.size()] ^= static_cast<std::uint8_t>(1u << (generator() % 8));
            }
            const auto decoded = decode_attachments(damaged, count_of(golden), golden.vertex_count);
            if (!decoded) continue;
            ++decoded_count;
            for (const Triangle& t : *decoded) {
                for (const std::int32_t v : t) ASSERT_TRUE(v >= 0 && v < golden.vertex_count);
            }
        }
    }
    EXPECT_GT(decoded_count, 0);
}

}  // namespace
}  // namespace batchenc
