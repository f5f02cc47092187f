#include "kernels/surface_coder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <set>

#include "tests/support/sample_meshes.h"

namespace batchenc {
namespace {

struct Coded {
    std::vector<std::uint8_t> bytes;
    CodedSurface surface;
    std::int64_t used_vertices() const { return static_cast<std::int64_t>(surface.source_vertex.size()); }
    std::int64_t triangle_count() const { return static_cast<std::int64_t>(surface.triangles.size()); }
};

Coded encode(const std::vector<Triangle>& triangles) {
    BitCoder coder;
    Coded coded;
    coded.surface = encode_surface(coder, Surface::of(triangles));
    coded.bytes = coder.finish();
    return coded;
}

Expected<CodedSurface> decode(std::span<const std::uint8_t> bytes, std::int64_t triangle_count,
                              std::int64_t vertex_count) {
    BitCoder coder(bytes);
    auto surface = decode_surface(coder, triangle_count, vertex_count);
    if (!surface) return surface;
    if (auto end = coder.check_end(); !end) return tl::unexpected(end.error());
    return surface;
}

// What the coder made of the triangles is theirs in another order, and comes back; gives bits a triangle.
double round_trip(const std::vector<Triangle>& triangles) {
    const Coded coded = encode(triangles);
    const CodedSurface& surface = coded.surface;
    EXPECT_EQ(surface.triangles.size(), triangles.size());
    EXPECT_EQ(surface.source_triangle.size(), triangles.size());
    if (surface.triangles.size() != triangles.size()) return 0.0;
    std::set<std::int32_t> sources, vertices;
    std::int32_t numbers = 0;
    for (std::size_t k = 0; k < triangles.size(); ++k) {
        sources.insert(surface.source_triangle[k]);
        std::array<std::int32_t, 3> mapped;
        std::int32_t highest = numbers - 1;
        for (std::size_t c = 0; c < 3; ++c) {
            const std::int32_t number = surface.triangles[k][c];
            EXPECT_LT(static_cast<std::size_t>(number), surface.source_vertex.size());
            highest = std::max(highest, number);
            mapped[c] = surface.source_vertex[static_cast<std::size_t>(number)];
        }
        EXPECT_LE(highest, numbers + 2);  // numbers in the order of coding
        numbers = highest + 1;
        const Triangle& source = triangles[static_cast<std::size_t>(surface.source_triangle[k])];
        EXPECT_EQ(test::without_order({mapped}), test::without_order({source}));
    }
    EXPECT_EQ(sources.size(), triangles.size());
    EXPECT_EQ(static_cast<std::size_t>(numbers), surface.source_vertex.size());
    for (const std::int32_t v : surface.source_vertex) EXPECT_TRUE(vertices.insert(v).second) << v;

    const auto decoded = decode(coded.bytes, coded.triangle_count(), coded.used_vertices());
    EXPECT_TRUE(decoded) << decoded.error().to_string();
    if (!decoded) return 0.0;
    EXPECT_EQ(decoded->triangles, surface.triangles);
    EXPECT_TRUE(decoded->source_triangle.empty() && decoded->source_vertex.empty());
    return triangles.empty()
               ? 0.0
               : 8.0 * static_cast<double>(coded.bytes.size()) / static_cast<double>(triangles.size());
}

void expect_sound(const Expected<CodedSurface>& decoded, std::int64_t triangle_count,
                  std::int64_t vertex_count) {
    if (!decoded) {
        ASSERT_EQ(decoded.error().code, ErrorCode::kCorrupt);
        return;
    }
    ASSERT_EQ(static_cast<std::int64_t>(decoded->triangles.size()), triangle_count);
    for (const Triangle& t : decoded->triangles) {
        for (const std::int32_t v : t) ASSERT_TRUE(v >= 0 && v < vertex_count);
    }
}

// Measured bits a triangle, three hundredths of slack either way: a loss fails, and a gain asks for a tighter
// figure.
void expect_rate(double measured, double expected) {
    EXPECT_GT(measured, 0.97 * expected);
    EXPECT_LT(measured, 1.03 * expected);
}

// What is damaged below.
std::vector<std::vector<Triangle>> some_meshes() {
    std::mt19937 generator(4);
    auto irregular = test::torus(10, 10);
    test::turn_edges(irregular, 500, generator);
    irregular.erase(irregular.begin() + 50, irregular.begin() + 60);
    return {test::grid(9, 8), irregular, test::random_cells(4, 4, generator),
            test::random_triangles(150, 40, generator), test::moebius_strip(12)};
}

TEST(SurfaceCoder, RoundTripsEveryKindOfMesh) {
    std::mt19937 generator(1);
    for (const auto& mesh : test::every_kind_of_mesh()) {
        for (const auto& [name, vertex_count, triangles] : {mesh, test::shuffled(mesh, generator)}) {
            SCOPED_TRACE(name);
            round_trip(triangles);
            if (testing::Test::HasFailure()) return;
        }
    }
}

TEST(SurfaceCoder, RoundTripsManyCellsAndSoups) {
    std::mt19937 generator(2);
    for (int trial = 0; trial < 300; ++trial) {
        SCOPED_TRACE(trial);
        round_trip(test::random_cells(1 + trial % 5, 1 + trial % 7, generator));
        round_trip(test::random_triangles(1 + trial % 40, 3 + trial % 11, generator));
        if (testing::Test::HasFailure()) return;
    }
}

TEST(SurfaceCoder, CodesNothingAsNothing) {
    EXPECT_TRUE(encode({}).bytes.empty());
    EXPECT_TRUE(decode({}, 0, 0));
    EXPECT_FALSE(decode({}, 1, 3));
    const std::vector<std::uint8_t> one_byte = {1};
    EXPECT_FALSE(decode(one_byte, 0, 3));
}

TEST(SurfaceCoder, KeepsWindingOfTrianglesThatWereFlipped) {
    const std::vector<Triangle> triangles = {{0, 1, 2}, {1, 2, 3}, {3, 2, 4}};
    const Coded coded = encode(triangles);
    std::vector<Triangle> mapped = coded.surface.triangles;
    for (Triangle& t : mapped) {
        for (std::int32_t& v : t) v = coded.surface.source_vertex[static_cast<std::size_t>(v)];
    }
    EXPECT_EQ(test::without_order(mapped), test::without_order(triangles));
}

TEST(SurfaceCoder, SpendsLittleWhereMeshesAreRegular) {
    std::mt19937 generator(3);
    expect_rate(round_trip(test::grid(40, 30)), 0.0672);
    expect_rate(round_trip(test::torus(40, 30)), 0.0433);
    EXPECT_LT(encode(test::torus(160, 120)).bytes.size(), 2 * encode(test::torus(40, 30)).bytes.size());
    auto mesh = test::torus(40, 30);
    test::shuffle(mesh, generator);
    test::rotate_corners(mesh, generator);
    test::rename_vertices(mesh, 1200, generator);
    expect_rate(round_trip(mesh), 0.0433);  // order costs nothing here
}

TEST(SurfaceCoder, SpendsWhatIrregularMeshesNeed) {
    std::mt19937 generator(3);
    auto mesh = test::torus(60, 50);
    test::turn_edges(mesh, 1000, generator);
    expect_rate(round_trip(mesh), 1.099);
    test::turn_edges(mesh, 30000, generator);
    expect_rate(round_trip(mesh), 1.836);
    mesh = test::grid(60, 50);
    test::shuffle(mesh, generator);
    mesh.resize(mesh.size() * 9 / 10);
    expect_rate(round_trip(mesh), 1.930);
    expect_rate(round_trip(test::random_cells(12, 4, generator)), 2.919);
    expect_rate(round_trip(test::random_triangles(3000, 1000, generator)), 27.52);
    expect_rate(round_trip(test::random_triangles(3000, 100000, generator)), 2.581);
}

TEST(SurfaceCoder, EncodesToTheSameBytesTwice) {
    for (const auto& triangles : some_meshes()) EXPECT_EQ(encode(triangles).bytes, encode(triangles).bytes);
}

TEST(SurfaceCoder, SpendsTheSameOnEveryOrderOfATorus) {
    std::mt19937 generator(6);
    const auto expected = encode(test::torus(12, 9)).bytes;
    auto mesh = test::torus(12, 9);
    test::rename_vertices(mesh, 12 * 9, generator);
    EXPECT_EQ(encode(mesh).bytes, expected);  // indices do not enter
}

TEST(SurfaceCoder, RejectsOtherCounts) {
    for (const auto& triangles : some_meshes()) {
        const Coded coded = encode(triangles);
        const std::int64_t count = coded.triangle_count(), used = coded.used_vertices();
        EXPECT_TRUE(decode(coded.bytes, count, used));
        EXPECT_TRUE(decode(coded.bytes, count, used + 1000));
        for (const std::int64_t wrong : {used - 1, used / 2, std::int64_t{1}, std::int64_t{0}}) {
            const auto decoded = decode(coded.bytes, count, wrong);
            ASSERT_FALSE(decoded) << wrong;
            EXPECT_EQ(decoded.error().code, ErrorCode::kCorrupt);
        }
        // A few triangles more or fewer can be another surface; many more are not there.
        for (const std::int64_t wrong : {std::int64_t{0}, std::int64_t{1}, count / 2, count - 1, count + 1})
            expect_sound(decode(coded.bytes, wrong, used), wrong, used);
        EXPECT_FALSE(decode(coded.bytes, 2 * count, used));
        EXPECT_FALSE(decode(coded.bytes, 700000000, used));
    }
}

// More triangles than stated would grow what is decoded beyond every limit that was looked at.
TEST(SurfaceCoder, NeverDecodesMoreTrianglesThanStated) {
    const Coded coded = encode(test::torus(12, 9));
    for (std::int64_t count = 0; count < coded.triangle_count(); ++count) {
        BitCoder coder(coded.bytes);
        expect_sound(decode_surface(coder, count, 1000), count, 1000);
    }
}

TEST(SurfaceCoder, RejectsTruncationsAndExtraBytes) {
    int accepted = 0;
    for (const auto& triangles : some_meshes()) {
        const Coded coded = encode(triangles);
        for (std::size_t size = 0; size < coded.bytes.size(); ++size) {
            const std::vector<std::uint8_t> cut(coded.bytes.begin(),
                                                coded.bytes.begin() + static_cast<std::ptrdiff_t>(size));
            // A cut stream can be that of another surface, though hardly ever; the checksum tells the rest.
            const auto decoded = decode(cut, coded.triangle_count(), coded.used_vertices());
            expect_sound(decoded, coded.triangle_count(), coded.used_vertices());
            if (!decoded) continue;
            ++accepted;
            EXPECT_NE(decoded->triangles, coded.surface.triangles) << size;
        }
        for (const int extra : {0, 1, 128, 255}) {
            auto longer = coded.bytes;
            longer.push_back(static_cast<std::uint8_t>(extra));
            EXPECT_FALSE(decode(longer, coded.triangle_count(), coded.used_vertices())) << extra;
        }
    }
    EXPECT_LE(accepted, 3);
}

TEST(SurfaceCoder, SurvivesDamage) {
    std::mt19937 generator(5);
    std::vector<Coded> all;
    for (const auto& triangles : some_meshes()) all.push_back(encode(triangles));
    int accepted = 0;
    for (int trial = 0; trial < 2000; ++trial) {
        const Coded& coded = all[static_cast<std::size_t>(trial) % all.size()];
        auto damaged = coded.bytes;
        for (int flips = test::draw(generator, 4) + 1; flips > 0; --flips) {
            damaged[static_cast<std::size_t>(test::draw(generator, static_cast<int>(damaged.size())))] ^=
                static_cast<std::uint8_t>(1u << test::draw(generator, 8));
        }
        BitCoder coder(damaged);  // without the check of the end, to accept more
        const auto decoded = decode_surface(coder, coded.triangle_count(), coded.used_vertices());
        expect_sound(decoded, coded.triangle_count(), coded.used_vertices());
        if (testing::Test::HasFatalFailure()) return;
        accepted += decoded ? 1 : 0;
    }
    EXPECT_GT(accepted, 0);
}

TEST(SurfaceCoder, SurvivesRandomBytes) {
    std::mt19937 generator(7);
    int accepted = 0;
    for (int trial = 0; trial < 2000; ++trial) {
        std::vector<std::uint8_t> bytes(static_cast<std::size_t>(1 + test::draw(generator, 200)));
        for (auto& b : bytes) b = static_cast<std::uint8_t>(generator());
        for (const std::int64_t count : {1, 2, 30, 1000000}) {
            const std::int64_t vertex_count = trial % 2 == 0 ? 1000 : 5;
            BitCoder coder(bytes);
            const auto decoded = decode_surface(coder, count, vertex_count);
            expect_sound(decoded, count, vertex_count);
            if (testing::Test::HasFatalFailure()) return;
            accepted += decoded ? 1 : 0;
        }
    }
    EXPECT_GT(accepted, 0);
}

// Bytes that files hold already: a change here is a new coder id, not a new expectation. A piece with a
// boundary, a flipped triangle, a third triangle at an edge, a degenerate one, and a closed piece.
TEST(SurfaceCoder, StillReadsAndWritesItsFirstBytes) {
    const std::vector<Triangle> triangles = {{0, 1, 2},    {0, 2, 3},    {4, 3, 2},    {2, 1, 5},
                                             {5, 2, 4},    {0, 1, 6},    {7, 7, 3},    {10, 11, 12},
                                             {10, 12, 13}, {10, 13, 11}, {11, 13, 12}, {1, 0, 8}};
    const std::vector<std::uint8_t> golden = {0x95, 0x79, 0x05, 0xb7, 0xd1, 0x30, 0xe9,
                                              0xd9, 0x62, 0xc4, 0x2e, 0x72, 0xab};
    const Coded coded = encode(triangles);
    EXPECT_EQ(coded.bytes, golden);
    const auto decoded = decode(golden, coded.triangle_count(), coded.used_vertices());
    ASSERT_TRUE(decoded);
    const std::vector<Triangle> in_coded_order = {{0, 1, 2},   {1, 0, 3},   {0, 2, 4},   {4, 2, 5},
                                                  {5, 6, 2},   {6, 2, 1},   {0, 1, 7},   {8, 8, 4},
                                                  {9, 10, 11}, {9, 11, 12}, {9, 12, 10}, {10, 12, 11}};
    EXPECT_EQ(decoded->triangles, in_coded_order);
    EXPECT_EQ(coded.surface.source_vertex,
              (std::vector<std::int32_t>{0, 1, 2, 8, 3, 4, 5, 6, 7, 10, 11, 12, 13}));
}

}  // namespace
}  // namespace batchenc
