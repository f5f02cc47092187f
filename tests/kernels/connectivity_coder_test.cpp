#include "kernels/connectivity_coder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>
#include <string>

#include "kernels/range_coder.h"

namespace batchenc {
namespace {

std::vector<Triangle> grid(std::int32_t columns, std::int32_t rows) {
    std::vector<Triangle> triangles;
    for (std::int32_t y = 0; y + 1 < rows; ++y) {
        for (std::int32_t x = 0; x + 1 < columns; ++x) {
            const std::int32_t v = columns * y + x;
            triangles.push_back({v, v + 1, v + columns + 1});
            triangles.push_back({v, v + columns + 1, v + columns});
        }
    }
    return triangles;
}

// Bits a triangle, after the way back gave the same.
double round_trip(const std::vector<Triangle>& triangles, std::int64_t vertex_count) {
    const auto encoded = encode_connectivity(triangles, vertex_count);
    EXPECT_TRUE(encoded);
    if (!encoded) return 0.0;
    EXPECT_EQ(encoded->order_bytes, 0);
    const auto decoded =
        decode_connectivity(encoded->bytes, static_cast<std::int64_t>(triangles.size()), vertex_count);
    EXPECT_TRUE(decoded) << decoded.error().to_string();
    EXPECT_TRUE(decoded && *decoded == triangles);
    return 8.0 * static_cast<double>(encoded->bytes.size()) / static_cast<double>(triangles.size());
}

void shuffle_vertices(std::vector<Triangle>& triangles, std::int32_t vertex_count, std::mt19937& generator) {
    std::vector<std::int32_t> name(static_cast<std::size_t>(vertex_count));
    for (std::size_t i = 0; i < name.size(); ++i) name[i] = static_cast<std::int32_t>(i);
    std::shuffle(name.begin(), name.end(), generator);
    for (Triangle& t : triangles) {
        for (std::int32_t& v : t) v = name[static_cast<std::size_t>(v)];
    }
}

// Measured bits a triangle, three hundredths of slack either way: a loss fails, and a gain asks for a tighter
// figure.
void expect_rate(double measured, double expected) {
    EXPECT_GT(measured, 0.97 * expected);
    EXPECT_LT(measured, 1.03 * expected);
}

TEST(ConnectivityCoder, RoundTripsGridsInEveryDisorder) {
    std::mt19937 generator(1);
    auto triangles = grid(40, 30);
    expect_rate(round_trip(triangles, 1200), 0.736);  // file order is nearly free where it is regular
    for (Triangle& t : triangles) std::rotate(t.begin(), t.begin() + generator() % 3, t.end());
    expect_rate(round_trip(triangles, 1200), 4.16);  // log2(3) of it for the rotations
    for (Triangle& t : triangles) {
        if (generator() % 2) std::swap(t[0], t[1]);
    }
    expect_rate(round_trip(triangles, 1200), 9.97);
    shuffle_vertices(triangles, 1200, generator);
    expect_rate(round_trip(triangles, 1200), 28.0);
    std::shuffle(triangles.begin(), triangles.end(), generator);
    expect_rate(round_trip(triangles, 1200), 33.9);  // three plain indices are 31
}

TEST(ConnectivityCoder, RoundTripsTrianglesDrawnAtRandom) {
    std::mt19937 generator(2);
    for (const std::int32_t vertex_count : {1, 2, 3, 5, 20, 1000, 100000, 40000000}) {
        std::uniform_int_distribution<std::int32_t> index(0, vertex_count - 1);
        for (const std::size_t triangle_count : {1, 2, 10, 3000}) {
            SCOPED_TRACE(std::to_string(vertex_count) + " " + std::to_string(triangle_count));
            std::vector<Triangle> triangles(triangle_count);
            for (Triangle& t : triangles) t = {index(generator), index(generator), index(generator)};
            round_trip(triangles, vertex_count);
        }
    }
}

TEST(ConnectivityCoder, RoundTripsTheLargestIndices) {
    constexpr std::int32_t kLast = std::numeric_limits<std::int32_t>::max() - 1;
    const std::vector<Triangle> triangles = {{0, kLast, 0}, {kLast, 0, kLast - 1}, {kLast, kLast - 1, 7},
                                             {0, 1, 2},     {kLast, kLast, kLast}, {kLast - 1, kLast, 5}};
    round_trip(triangles, std::int64_t{kLast} + 1);
}

TEST(ConnectivityCoder, CodesNothingAsNothing) {
    const auto encoded = encode_connectivity({}, 10);
    ASSERT_TRUE(encoded);
    EXPECT_TRUE(encoded->bytes.empty());
    const auto decoded = decode_connectivity(encoded->bytes, 0, 10);
    ASSERT_TRUE(decoded);
    EXPECT_TRUE(decoded->empty());
    const std::vector<std::uint8_t> one_byte = {0};
    EXPECT_FALSE(decode_connectivity(one_byte, 0, 10));
}

TEST(ConnectivityCoder, EncodesToTheSameBytesTwice) {
    const auto triangles = grid(20, 20);
    EXPECT_EQ(encode_connectivity(triangles, 400)->bytes, encode_connectivity(triangles, 400)->bytes);
}

// Bytes that files hold already: a change here is a new coder id, not a new expectation.
TEST(ConnectivityCoder, StillReadsAndWritesItsFirstBytes) {
    const std::vector<Triangle> triangles = {{0, 1, 2}, {0, 2, 3},     {4, 3, 2},
                                             {2, 1, 5}, {9, 70000, 8}, {8, 70000, 6}};
    const std::vector<std::uint8_t> golden = {
        0x18, 0xd9, 0xf7, 0x10, 0x00, 0x60, 0xa0, 0x32, 0x00, 0x05, 0x08, 0x09, 0x0a, 0x03, 0x07, 0x04, 0x07,
        0x00, 0x05, 0x0f, 0x07, 0x09, 0x9f, 0x6f, 0x0f, 0x08, 0x92, 0x31, 0x9d, 0x50, 0x70, 0x60, 0x69};
    const auto encoded = encode_connectivity(triangles, 70001);
    ASSERT_TRUE(encoded);
    EXPECT_EQ(encoded->bytes, golden);
    const auto decoded = decode_connectivity(golden, static_cast<std::int64_t>(triangles.size()), 70001);
    ASSERT_TRUE(decoded);
    EXPECT_EQ(*decoded, triangles);
}

TEST(ConnectivityCoder, NamesTheTriangleOfAnIndexOutOfRange) {
    for (const std::int32_t bad : {-1, 4, std::numeric_limits<std::int32_t>::max()}) {
        const std::vector<Triangle> triangles = {{0, 1, 2}, {3, bad, 0}};
        const auto encoded = encode_connectivity(triangles, 4);
        ASSERT_FALSE(encoded);
        EXPECT_EQ(encoded.error().code, ErrorCode::kOutOfRange);
        EXPECT_NE(encoded.error().message.find("triangle 1 has vertex " + std::to_string(bad)),
                  std::string::npos);
    }
    EXPECT_EQ(encode_connectivity({}, -1).error().code, ErrorCode::kInvalidArgument);
    EXPECT_EQ(encode_connectivity({}, std::int64_t{1} << 31).error().code, ErrorCode::kInvalidArgument);
}

TEST(ConnectivityCoder, RejectsEveryTruncationAndExtraBytes) {
    std::mt19937 generator(3);
    auto triangles = grid(12, 12);
    shuffle_vertices(triangles, 144, generator);
    const auto count = static_cast<std::int64_t>(triangles.size());
    const auto bytes = encode_connectivity(triangles, 144)->bytes;
    for (std::size_t size = 0; size < bytes.size(); ++size) {
        const std::vector<std::uint8_t> cut(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size));
        const auto decoded = decode_connectivity(cut, count, 144);
        ASSERT_FALSE(decoded) << size;
        ASSERT_EQ(decoded.error().code, ErrorCode::kCorrupt);
    }
    auto longer = bytes;
    longer.push_back(0);
    EXPECT_FALSE(decode_connectivity(longer, count, 144));
    EXPECT_FALSE(decode_connectivity(bytes, count - 1, 144));
    EXPECT_FALSE(decode_connectivity(bytes, count + 1, 144));
}

TEST(ConnectivityCoder, RejectsCountsThatTheBytesCannotHold) {
    const std::vector<std::uint8_t> bytes(8);
    for (const std::int64_t count : {std::int64_t{-1}, static_cast<std::int64_t>(max_symbol_count(8)),
                                     std::numeric_limits<std::int64_t>::max()}) {
        const auto decoded = decode_connectivity(bytes, count, 10);
        ASSERT_FALSE(decoded);
        EXPECT_EQ(decoded.error().code, ErrorCode::kCorrupt);
    }
    EXPECT_EQ(decode_connectivity(bytes, 1, std::int64_t{1} << 31).error().code, ErrorCode::kCorrupt);
    EXPECT_EQ(decode_connectivity(bytes, 1, -1).error().code, ErrorCode::kCorrupt);
}

// A whole and sound stream, but for a mesh that has more vertices than the header says.
TEST(ConnectivityCoder, RejectsIndicesThatTheHeaderRulesOut) {
    const std::vector<std::vector<Triangle>> meshes = {
        {{0, 1, 2}, {0, 50, 60}},             // both of a free triangle
        {{0, 1, 2}, {2, 1, 60}},              // third vertex of a gate, by its distance
        {{0, 1, 2}, {2, 1, 3}, {2, 3, 4}},    // third vertex of a gate, as the next index
        {{0, 1, 60}, {2, 3, 4}, {60, 1, 5}},  // the first triangle
    };
    for (const auto& triangles : meshes) {
        std::int32_t largest = 0;
        for (const Triangle& t : triangles)
            largest = std::max(largest, *std::max_element(t.begin(), t.end()));
        const auto bytes = encode_connectivity(triangles, largest + 1)->bytes;
        const auto count = static_cast<std::int64_t>(triangles.size());
        EXPECT_TRUE(decode_connectivity(bytes, count, largest + 1));
        for (const std::int64_t vertex_count : {largest, largest - 1, 1, 0}) {
            const auto decoded = decode_connectivity(bytes, count, vertex_count);
            ASSERT_FALSE(decoded) << largest << " " << vertex_count;
            EXPECT_EQ(decoded.error().code, ErrorCode::kCorrupt);
        }
    }
}

// Sound streams of symbols, each in a context met for the first time, that the encoder never makes.
TEST(ConnectivityCoder, RejectsSymbolsThatTheEncoderNeverMakes) {
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
        const auto decoded = decode_connectivity(coder.finish(), 1, 10);
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
    const auto decoded = decode_connectivity(coder.finish(), 1, 10);
    ASSERT_TRUE(decoded) << decoded.error().to_string();
    EXPECT_EQ(*decoded, (std::vector<Triangle>{{0, 0, 0}}));
}

TEST(ConnectivityCoder, SurvivesDamageWithoutAnIndexOutOfRange) {
    std::mt19937 generator(4);
    auto triangles = grid(16, 16);
    shuffle_vertices(triangles, 256, generator);
    const auto count = static_cast<std::int64_t>(triangles.size());
    const auto bytes = encode_connectivity(triangles, 256)->bytes;
    for (int trial = 0; trial < 500; ++trial) {
        auto damaged = bytes;
        for (unsigned flips = generator() % 4 + 1; flips > 0; --flips) {
            damaged[generator() % damaged.size()] ^= static_cast<std::uint8_t>(1u << (generator() % 8));
        }
        const auto decoded = decode_connectivity(damaged, count, 256);
        if (!decoded) continue;
        for (const Triangle& t : *decoded) {
            for (const std::int32_t v : t) ASSERT_TRUE(v >= 0 && v < 256);
        }
    }
}

}  // namespace
}  // namespace batchenc
