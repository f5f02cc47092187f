#include "kernels/order_coder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "kernels/surface.h"
#include "tests/support/sample_meshes.h"

namespace batchenc {
namespace {

struct Coded {
    std::vector<std::uint8_t> order_bytes;
    CodedSurface surface;  // as a decoder has it
};

Coded encode(const std::vector<Triangle>& triangles, std::int64_t vertex_count) {
    BitCoder surface_coder, order_coder;
    const CodedSurface surface = encode_surface(surface_coder, Surface::of(triangles));
    encode_order(order_coder, surface, triangles, vertex_count);
    const auto surface_bytes = surface_coder.finish();
    BitCoder decoder(surface_bytes);
    auto decoded = decode_surface(decoder, static_cast<std::int64_t>(triangles.size()), vertex_count);
    EXPECT_TRUE(decoded && decoder.check_end());
    return {order_coder.finish(), decoded ? std::move(*decoded) : CodedSurface{}};
}

Expected<std::vector<Triangle>> decode(std::span<const std::uint8_t> bytes, const CodedSurface& surface,
                                       std::int64_t vertex_count) {
    BitCoder coder(bytes);
    auto triangles = decode_order(coder, surface, vertex_count);
    if (!triangles) return triangles;
    if (auto end = coder.check_end(); !end) return tl::unexpected(end.error());
    return triangles;
}

// Bits a triangle for its order, after the way back gave the very same triangles.
double round_trip(const std::vector<Triangle>& triangles, std::int64_t vertex_count) {
    const Coded coded = encode(triangles, vertex_count);
    const auto decoded = decode(coded.order_bytes, coded.surface, vertex_count);
    EXPECT_TRUE(decoded) << decoded.error().to_string();
    EXPECT_TRUE(decoded && *decoded == triangles);
    return triangles.empty()
               ? 0.0
               : 8.0 * static_cast<double>(coded.order_bytes.size()) / static_cast<double>(triangles.size());
}

void expect_sound(const Expected<std::vector<Triangle>>& decoded, const CodedSurface& surface,
                  std::int64_t vertex_count) {
    if (!decoded) {
        ASSERT_EQ(decoded.error().code, ErrorCode::kCorrupt);
        return;
    }
    ASSERT_EQ(decoded->size(), surface.triangles.size());
    for (const Triangle& t : *decoded) {
        for (const std::int32_t v : t) ASSERT_TRUE(v >= 0 && v < vertex_count);
    }
}

// Measured bits a triangle, three hundredths of slack either way: a loss fails, and a gain asks for a tighter
// figure.
void expect_rate(double measured, double expected) {
    EXPECT_GT(measured, 0.97 * expected);
    EXPECT_LT(measured, 1.03 * expected);
}

std::vector<test::NamedMesh> some_meshes() {
    std::mt19937 generator(4);
    auto irregular = test::torus(10, 10);
    test::turn_edges(irregular, 500, generator);
    irregular.erase(irregular.begin() + 50, irregular.begin() + 60);
    return {{"grid", 72, test::grid(9, 8)},
            test::shuffled({"grid", 72, test::grid(9, 8)}, generator),
            {"irregular", 100, irregular},
            {"cells", 125, test::random_cells(4, 4, generator)},
            {"soup", 40, test::random_triangles(150, 40, generator)},
            {"far apart", 1000000000, test::random_triangles(50, 1000000000, generator)}};
}

TEST(OrderCoder, RoundTripsEveryKindOfMesh) {
    std::mt19937 generator(1);
    for (const auto& mesh : test::every_kind_of_mesh()) {
        for (const auto& [name, vertex_count, triangles] : {mesh, test::shuffled(mesh, generator)}) {
            SCOPED_TRACE(name);
            round_trip(triangles, vertex_count);
            if (testing::Test::HasFailure()) return;
        }
    }
}

TEST(OrderCoder, RoundTripsManyCellsAndSoups) {
    std::mt19937 generator(2);
    for (int trial = 0; trial < 200; ++trial) {
        SCOPED_TRACE(trial);
        const std::int32_t side = 1 + trial % 5, vertex_count = 3 + trial % 11;
        const auto cells = test::random_cells(side, 1 + trial % 7, generator);
        round_trip(cells, (side + 1) * (side + 1) * (side + 1));
        round_trip(test::random_triangles(1 + trial % 40, vertex_count, generator), vertex_count);
        if (testing::Test::HasFailure()) return;
    }
}

TEST(OrderCoder, RoundTripsTheLargestIndices) {
    constexpr std::int32_t kLast = std::numeric_limits<std::int32_t>::max() - 1;
    round_trip({{kLast, kLast - 1, kLast - 2}}, std::int64_t{kLast} + 1);
    round_trip({{kLast, kLast, kLast}}, std::int64_t{kLast} + 1);
    round_trip({{0, kLast, 1}, {kLast, 0, 2}}, std::int64_t{kLast} + 1);
}

TEST(OrderCoder, CodesNothingAsNothing) {
    const Coded coded = encode({}, 10);
    EXPECT_TRUE(coded.order_bytes.empty());
    EXPECT_TRUE(decode({}, coded.surface, 10));
    const std::vector<std::uint8_t> one_byte = {1};
    EXPECT_FALSE(decode(one_byte, coded.surface, 10));
}

TEST(OrderCoder, SpendsLittleWhereFilesAreRegular) {
    expect_rate(round_trip(test::grid(40, 30), 1200), 0.297);
    expect_rate(round_trip(test::torus(40, 30), 1200), 0.567);
    auto mesh = test::grid(40, 30);
    for (std::size_t t = 1; t < mesh.size(); t += 2) std::swap(mesh[t][0], mesh[t][1]);
    expect_rate(round_trip(mesh, 1200), 0.290);  // nor does the other winding cost
    auto turned = test::torus(40, 30);
    std::mt19937 generator(8);
    for (Triangle& t : turned) {
        if (test::draw(generator, 2) == 1) t = {t[1], t[0], t[2]};
    }
    expect_rate(round_trip(turned, 1200), 0.617);
}

TEST(OrderCoder, SpendsWhatDisorderNeeds) {
    std::mt19937 generator(3);
    auto mesh = test::grid(40, 30);
    test::rotate_corners(mesh, generator);
    expect_rate(round_trip(mesh, 1200), 1.906);  // log2(3) for the corners
    auto renamed = mesh;
    test::rename_vertices(renamed, 1200, generator);
    expect_rate(round_trip(renamed, 1200), 7.27);
    test::shuffle(mesh, generator);
    expect_rate(round_trip(mesh, 1200), 13.17);
    test::rename_vertices(mesh, 1200, generator);
    // log2(2262! 1200!) / 2262 + log2(3) = 9.70 + 4.66 + 1.58 for any order at all
    expect_rate(round_trip(mesh, 1200), 18.37);
}

TEST(OrderCoder, EncodesToTheSameBytesTwice) {
    for (const auto& mesh : some_meshes()) {
        EXPECT_EQ(encode(mesh.triangles, mesh.vertex_count).order_bytes,
                  encode(mesh.triangles, mesh.vertex_count).order_bytes);
    }
}

TEST(OrderCoder, RejectsIndicesThatTheHeaderRulesOut) {
    for (const auto& [name, vertex_count, triangles] : some_meshes()) {
        std::int64_t largest = 0;
        for (const Triangle& t : triangles) largest = std::max<std::int64_t>({largest, t[0], t[1], t[2]});
        const Coded coded = encode(triangles, vertex_count);
        EXPECT_TRUE(decode(coded.order_bytes, coded.surface, largest + 1)) << name;
        for (const std::int64_t wrong : {largest, largest / 2, std::int64_t{1}, std::int64_t{0}}) {
            const auto decoded = decode(coded.order_bytes, coded.surface, wrong);
            ASSERT_FALSE(decoded) << name << " " << wrong;
            EXPECT_EQ(decoded.error().code, ErrorCode::kCorrupt);
        }
    }
}

TEST(OrderCoder, RejectsTruncationsAndExtraBytes) {
    int accepted = 0;
    for (const auto& [name, vertex_count, triangles] : some_meshes()) {
        const Coded coded = encode(triangles, vertex_count);
        for (std::size_t size = 0; size < coded.order_bytes.size(); ++size) {
            const std::vector<std::uint8_t> cut(
                coded.order_bytes.begin(), coded.order_bytes.begin() + static_cast<std::ptrdiff_t>(size));
            // A cut stream can be that of another order, though hardly ever; the checksum tells the rest.
            const auto decoded = decode(cut, coded.surface, vertex_count);
            expect_sound(decoded, coded.surface, vertex_count);
            if (!decoded) continue;
            ++accepted;
            EXPECT_NE(*decoded, triangles) << name << " " << size;
        }
        for (const int extra : {0, 1, 128, 255}) {
            auto longer = coded.order_bytes;
            longer.push_back(static_cast<std::uint8_t>(extra));
            EXPECT_FALSE(decode(longer, coded.surface, vertex_count)) << name << " " << extra;
        }
    }
    EXPECT_LE(accepted, 3);
}

TEST(OrderCoder, SurvivesDamage) {
    std::mt19937 generator(5);
    const auto meshes = some_meshes();
    std::vector<Coded> coded;
    for (const auto& mesh : meshes) coded.push_back(encode(mesh.triangles, mesh.vertex_count));
    int accepted = 0;
    for (int trial = 0; trial < 2000; ++trial) {
        const std::size_t m = static_cast<std::size_t>(trial) % meshes.size();
        auto damaged = coded[m].order_bytes;
        for (int flips = test::draw(generator, 4) + 1; flips > 0; --flips) {
            damaged[static_cast<std::size_t>(test::draw(generator, static_cast<int>(damaged.size())))] ^=
                static_cast<std::uint8_t>(1u << test::draw(generator, 8));
        }
        BitCoder coder(damaged);  // without the check of the end, to accept more
        const auto decoded = decode_order(coder, coded[m].surface, meshes[m].vertex_count);
        expect_sound(decoded, coded[m].surface, meshes[m].vertex_count);
        if (testing::Test::HasFatalFailure()) return;
        accepted += decoded ? 1 : 0;
    }
    EXPECT_GT(accepted, 0);
}

TEST(OrderCoder, SurvivesRandomBytes) {
    std::mt19937 generator(7);
    std::vector<std::pair<std::int64_t, CodedSurface>> surfaces;
    for (const auto& [name, vertex_count, triangles] : some_meshes()) {
        for (const std::ptrdiff_t count : {1, 2, 5, 20}) {
            const std::vector<Triangle> few(triangles.begin(), triangles.begin() + count);
            surfaces.emplace_back(vertex_count, encode(few, vertex_count).surface);
        }
    }
    int accepted = 0;
    for (int trial = 0; trial < 2000; ++trial) {
        const auto& [vertex_count, surface] = surfaces[static_cast<std::size_t>(trial) % surfaces.size()];
        std::vector<std::uint8_t> bytes(static_cast<std::size_t>(test::draw(generator, 100)));
        for (auto& b : bytes) b = static_cast<std::uint8_t>(trial % 5 == 0 ? 0 : generator());
        BitCoder coder(bytes);
        const auto decoded = decode_order(coder, surface, vertex_count);
        expect_sound(decoded, surface, vertex_count);
        if (testing::Test::HasFatalFailure()) return;
        accepted += decoded ? 1 : 0;
    }
    EXPECT_GT(accepted, 0);
}

// Bytes that files hold already: a change here is a new coder id, not a new expectation.
TEST(OrderCoder, StillReadsAndWritesItsFirstBytes) {
    const std::vector<Triangle> triangles = {{0, 1, 2},    {0, 2, 3},    {4, 3, 2},    {2, 1, 5},
                                             {5, 2, 4},    {0, 1, 6},    {7, 7, 3},    {10, 11, 12},
                                             {10, 12, 13}, {10, 13, 11}, {11, 13, 12}, {1, 0, 8}};
    const std::vector<std::uint8_t> golden = {0x98, 0x5c, 0x3f, 0x8b, 0x6e, 0xcf, 0x1c, 0xcd};
    const Coded coded = encode(triangles, 15);
    EXPECT_EQ(coded.order_bytes, golden);
    const auto decoded = decode(golden, coded.surface, 15);
    ASSERT_TRUE(decoded);
    EXPECT_EQ(*decoded, triangles);
}

}  // namespace
}  // namespace batchenc
