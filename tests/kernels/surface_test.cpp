#include "kernels/surface.h"

#include <gtest/gtest.h>

#include <limits>
#include <numeric>
#include <set>

#include "tests/support/sample_meshes.h"

namespace batchenc {
namespace {

using Halves = std::vector<std::int32_t>;
using Flags = std::vector<std::uint8_t>;

bool is_degenerate(const Triangle& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; }

std::int32_t end_of(const Surface& surface, std::int32_t half) { return surface.start(Surface::next(half)); }

// What holds of the surface of any triangles, found in another way than the surface was.
void expect_sound(const Surface& surface, const std::vector<Triangle>& source) {
    ASSERT_EQ(surface.triangles.size(), source.size());
    ASSERT_EQ(surface.is_flipped.size(), source.size());
    ASSERT_EQ(surface.twin.size(), 3 * source.size());
    ASSERT_EQ(surface.fan.size(), 3 * source.size());
    ASSERT_EQ(surface.fan_size.size(), surface.fan_is_open.size());
    for (std::size_t t = 0; t < source.size(); ++t) {
        const Triangle turned = {source[t][0], source[t][2], source[t][1]};
        ASSERT_EQ(surface.triangles[t], surface.is_flipped[t] ? turned : source[t]);
    }

    // Corners that are joined over glued edges, by union-find.
    const auto half_count = static_cast<std::int32_t>(surface.twin.size());
    std::vector<std::int32_t> parent(surface.twin.size());
    std::iota(parent.begin(), parent.end(), 0);
    const auto root = [&](std::int32_t h) {
        while (parent[static_cast<std::size_t>(h)] != h) h = parent[static_cast<std::size_t>(h)];
        return h;
    };
    std::vector<std::int32_t> size(surface.fan_size.size(), 0);
    Flags is_open(surface.fan_size.size(), 0);
    std::set<std::pair<std::int32_t, std::int32_t>> unglued;
    for (std::int32_t h = 0; h < half_count; ++h) {
        const std::int32_t fan = surface.fan[static_cast<std::size_t>(h)];
        ASSERT_GE(fan, 0);
        ASSERT_LT(static_cast<std::size_t>(fan), size.size());
        ++size[static_cast<std::size_t>(fan)];
        const std::int32_t twin = surface.twin[static_cast<std::size_t>(h)];
        if (twin == -1) {
            is_open[static_cast<std::size_t>(fan)] = 1;
            if (!is_degenerate(surface.triangles[static_cast<std::size_t>(h / 3)]))
                unglued.emplace(surface.start(h), end_of(surface, h));
            continue;
        }
        ASSERT_GE(twin, 0);
        ASSERT_LT(twin, half_count);
        ASSERT_NE(twin / 3, h / 3);
        ASSERT_EQ(surface.twin[static_cast<std::size_t>(twin)], h);
        ASSERT_EQ(surface.start(twin), end_of(surface, h));
        ASSERT_EQ(end_of(surface, twin), surface.start(h));
        ASSERT_FALSE(is_degenerate(surface.triangles[static_cast<std::size_t>(h / 3)]));
        parent[static_cast<std::size_t>(root(h))] = root(Surface::next(twin));
    }
    EXPECT_EQ(surface.fan_size, size);
    std::vector<std::int32_t> root_of_fan(size.size(), -1);
    std::set<std::int32_t> roots;
    for (std::int32_t h = 0; h < half_count; ++h) {
        std::int32_t& known = root_of_fan[static_cast<std::size_t>(surface.fan[static_cast<std::size_t>(h)])];
        if (known == -1) {
            known = root(h);
            ASSERT_TRUE(roots.insert(known).second) << "two fans hang together";
        }
        ASSERT_EQ(root(h), known) << "a fan does not hang together";
    }
    EXPECT_EQ(surface.fan_is_open, is_open);
    // Nothing is left unglued that could be glued.
    for (const auto& [a, b] : unglued) ASSERT_FALSE(unglued.contains({b, a})) << a << " " << b;
}

std::int64_t unglued_count(const Surface& surface) {
    return std::count(surface.twin.begin(), surface.twin.end(), -1);
}

TEST(Surface, CountsHalfEdgesAroundATriangle) {
    EXPECT_EQ(Surface::next(6), 7);
    EXPECT_EQ(Surface::next(7), 8);
    EXPECT_EQ(Surface::next(8), 6);
    EXPECT_EQ(Surface::previous(6), 8);
    EXPECT_EQ(Surface::previous(7), 6);
    EXPECT_EQ(Surface::previous(8), 7);
}

TEST(Surface, OfNothingIsEmpty) {
    const Surface surface = Surface::of({});
    EXPECT_TRUE(surface.triangles.empty() && surface.twin.empty() && surface.fan_size.empty());
}

TEST(Surface, OfOneTriangleHasThreeOpenFans) {
    const std::vector<Triangle> source = {{7, 3, 5}};
    const Surface surface = Surface::of(source);
    EXPECT_EQ(surface.triangles, source);
    EXPECT_EQ(surface.twin, (Halves{-1, -1, -1}));
    EXPECT_EQ(surface.fan, (Halves{0, 1, 2}));
    EXPECT_EQ(surface.fan_size, (Halves{1, 1, 1}));
    EXPECT_EQ(surface.fan_is_open, (Flags{1, 1, 1}));
    EXPECT_EQ(surface.start(1), 3);
}

TEST(Surface, OfATetrahedronIsClosed) {
    const std::vector<Triangle> source = {{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}};
    const Surface surface = Surface::of(source);
    EXPECT_EQ(surface.is_flipped, (Flags{0, 0, 0, 0}));
    EXPECT_EQ(surface.twin, (Halves{8, 11, 3, 2, 10, 6, 5, 9, 0, 7, 4, 1}));
    EXPECT_EQ(surface.fan, (Halves{0, 1, 2, 0, 2, 3, 0, 3, 1, 1, 3, 2}));
    EXPECT_EQ(surface.fan_size, (Halves{3, 3, 3, 3}));
    EXPECT_EQ(surface.fan_is_open, (Flags{0, 0, 0, 0}));
}

TEST(Surface, OfAStripIsOpen) {
    const std::vector<Triangle> source = {{0, 1, 2}, {2, 1, 3}, {2, 3, 4}};
    const Surface surface = Surface::of(source);
    EXPECT_EQ(surface.twin, (Halves{-1, 3, -1, 1, -1, 6, 5, -1, -1}));
    EXPECT_EQ(surface.fan, (Halves{0, 1, 2, 2, 1, 3, 2, 3, 4}));
    EXPECT_EQ(surface.fan_size, (Halves{1, 2, 3, 2, 1}));
    EXPECT_EQ(surface.fan_is_open, (Flags{1, 1, 1, 1, 1}));
}

TEST(Surface, MixesOpenAndClosedFans) {
    const std::vector<Triangle> source = {{0, 1, 2}, {0, 2, 3}, {0, 3, 1}};
    const Surface surface = Surface::of(source);
    EXPECT_EQ(surface.fan, (Halves{0, 1, 2, 0, 2, 3, 0, 3, 1}));
    EXPECT_EQ(surface.fan_size, (Halves{3, 2, 2, 2}));
    EXPECT_EQ(surface.fan_is_open, (Flags{0, 1, 1, 1}));
}

TEST(Surface, GluesTwoOfThreeTrianglesAtAnEdge) {
    const std::vector<Triangle> source = {{0, 1, 2}, {1, 0, 3}, {0, 1, 4}};
    const Surface surface = Surface::of(source);
    EXPECT_EQ(surface.triangles, source);
    EXPECT_EQ(surface.twin, (Halves{3, -1, -1, 0, -1, -1, -1, -1, -1}));
    EXPECT_EQ(surface.fan, (Halves{0, 1, 2, 1, 0, 3, 4, 5, 6}));
    EXPECT_EQ(surface.fan_size, (Halves{2, 2, 1, 1, 1, 1, 1}));
    expect_sound(surface, source);
}

TEST(Surface, GluesManyTrianglesAtAnEdgeInPairs) {
    const std::vector<Triangle> source = {{0, 1, 2}, {0, 1, 3}, {1, 0, 4}, {0, 1, 5}, {1, 0, 6}};
    const Surface surface = Surface::of(source);
    EXPECT_EQ(surface.twin[0], 6);
    EXPECT_EQ(surface.twin[3], 12);
    EXPECT_EQ(surface.twin[9], -1);
    expect_sound(surface, source);
}

TEST(Surface, WindsTrianglesAsTheFirstOfTheirPiece) {
    const std::vector<Triangle> source = {{0, 1, 2}, {1, 2, 3}, {3, 2, 4}, {9, 8, 7}, {8, 9, 6}, {7, 9, 5}};
    const Surface surface = Surface::of(source);
    EXPECT_EQ(surface.is_flipped, (Flags{0, 1, 1, 0, 0, 1}));
    EXPECT_EQ(surface.triangles,
              (std::vector<Triangle>{{0, 1, 2}, {1, 3, 2}, {3, 4, 2}, {9, 8, 7}, {8, 9, 6}, {7, 5, 9}}));
    EXPECT_EQ(surface.twin, (Halves{-1, 5, -1, -1, 8, 1, -1, -1, 4, 12, -1, 17, 9, -1, -1, -1, -1, 11}));
    expect_sound(surface, source);
}

TEST(Surface, IsTheSameForAnyWinding) {
    std::mt19937 generator(1);
    auto source = test::torus(8, 6);
    for (std::size_t t = 1; t < source.size(); ++t) {
        if (test::draw(generator, 2) == 1) std::swap(source[t][0], source[t][1]);
    }
    const Surface surface = Surface::of(source);
    expect_sound(surface, source);
    EXPECT_EQ(unglued_count(surface), 0);
    EXPECT_EQ(test::without_order(surface.triangles), test::without_order(test::torus(8, 6)));
}

TEST(Surface, CutsWhatHasOneSide) {
    for (const auto& source : {test::moebius_strip(9), test::torus(8, 7, true)}) {
        const Surface surface = Surface::of(source);
        expect_sound(surface, source);
        // The strip's border, or none; and some edges of two triangles, whose half-edges run the same way
        // now.
        const std::int64_t border = source.size() == 18 ? 18 : 0;
        EXPECT_GT(unglued_count(surface), border);
        EXPECT_LT(unglued_count(surface), border + 40);
    }
}

TEST(Surface, LeavesDegenerateTrianglesAlone) {
    const std::vector<Triangle> source = {{0, 1, 2}, {0, 0, 1}, {1, 2, 1}, {2, 2, 2}, {2, 1, 3}};
    const Surface surface = Surface::of(source);
    EXPECT_EQ(surface.triangles, source);
    EXPECT_EQ(surface.twin, (Halves{-1, 12, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, 1, -1, -1}));
    for (std::size_t h = 3; h < 12; ++h) {
        const auto fan = static_cast<std::size_t>(surface.fan[h]);
        EXPECT_EQ(surface.fan_size[fan], 1);
        EXPECT_EQ(surface.fan_is_open[fan], 1);
    }
    expect_sound(surface, source);
}

TEST(Surface, GluesRepeatedTrianglesBackToBack) {
    const std::vector<Triangle> source = {{0, 1, 2}, {1, 2, 0}};
    const Surface surface = Surface::of(source);
    EXPECT_EQ(surface.is_flipped, (Flags{0, 1}));
    EXPECT_EQ(unglued_count(surface), 0);
    EXPECT_EQ(surface.fan_size, (Halves{2, 2, 2}));
    EXPECT_EQ(surface.fan_is_open, (Flags{0, 0, 0}));
    expect_sound(surface, source);
}

TEST(Surface, HasTwoFansAtABowTie) {
    const std::vector<Triangle> source = {{0, 1, 2}, {2, 3, 4}};
    const Surface surface = Surface::of(source);
    EXPECT_EQ(surface.fan, (Halves{0, 1, 2, 3, 4, 5}));  // half-edges 2 and 3 begin at vertex 2
    EXPECT_EQ(surface.start(2), surface.start(3));
}

TEST(Surface, FindsFansOfAnySize) {
    for (const bool is_open : {false, true}) {
        const Surface surface = Surface::of(test::fan(5000, is_open));
        EXPECT_EQ(surface.fan_size[0], 5000);
        EXPECT_EQ(surface.fan_is_open[0], is_open ? 1 : 0);
        EXPECT_EQ(surface.fan_size.size(), is_open ? 5002u : 5001u);
    }
}

TEST(Surface, TellsLargeIndicesApart) {
    constexpr std::int32_t kLast = std::numeric_limits<std::int32_t>::max() - 1;
    const std::vector<Triangle> source = {{kLast, kLast - 1, 0},
                                          {kLast - 1, kLast, 65536},
                                          {kLast - 65536, 0, kLast - 1},
                                          {0, 1, 2},
                                          {65536, 65537, 2}};
    const Surface surface = Surface::of(source);
    EXPECT_EQ(surface.twin, (Halves{3, 7, -1, 0, -1, -1, -1, 1, -1, -1, -1, -1, -1, -1, -1}));
    expect_sound(surface, source);
}

TEST(Surface, IsSoundForEveryKindOfMesh) {
    std::mt19937 generator(2);
    for (const auto& mesh : test::every_kind_of_mesh()) {
        for (const auto& [name, vertex_count, triangles] : {mesh, test::shuffled(mesh, generator)}) {
            SCOPED_TRACE(name);
            expect_sound(Surface::of(triangles), triangles);
            if (testing::Test::HasFatalFailure()) return;
        }
    }
}

TEST(Surface, HasOneFanAVertexWhereItIsRegular) {
    const Surface surface = Surface::of(test::torus(12, 9));
    EXPECT_EQ(unglued_count(surface), 0);
    EXPECT_EQ(surface.fan_size, Halves(12 * 9, 6));
    EXPECT_EQ(surface.fan_is_open, Flags(12 * 9, 0));
    const Surface sheet = Surface::of(test::grid(13, 10));
    EXPECT_EQ(sheet.fan_size.size(), 130u);
    EXPECT_EQ(std::count(sheet.fan_is_open.begin(), sheet.fan_is_open.end(), 1), 2 * (13 + 10) - 4);
    EXPECT_EQ(unglued_count(sheet), 2 * (12 + 9));
}

}  // namespace
}  // namespace batchenc
