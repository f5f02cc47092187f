#include "kernels/seeds.h"

#include <gtest/gtest.h>

#include "kernels/bounding_box.h"
#include "kernels/seed_triangles.h"
#include "tests/support/sample_clips.h"

namespace batchenc {
namespace {

std::vector<SeedTriangle> choose_seed_triangles(PositionsView positions, std::span<const Triangle> triangles,
                                                std::span<const std::int32_t> seeds,
                                                const Executor& executor) {
    const VertexTriangles vertex_triangles(triangles, positions.vertex_count());
    SeedTriangleChooser chooser(positions, triangles, vertex_triangles,
                                bounding_box(positions).largest_side());
    std::vector<SeedTriangle> chosen;
    for (const std::int32_t seed : seeds) chosen.push_back(chooser.choose(seed, executor));
    return chosen;
}

TEST(BoundingBox, HoldsEveryFrame) {
    for (const auto& [name, clip] : test::every_kind_of_clip()) {
        const BoundingBox box = bounding_box(clip.view());
        std::array<float, 3> low = {1e30f, 1e30f, 1e30f}, high = {-1e30f, -1e30f, -1e30f};
        for (std::size_t i = 0; i < clip.positions.size(); ++i) {
            low[i % 3] = std::min(low[i % 3], clip.positions[i]);
            high[i % 3] = std::max(high[i % 3], clip.positions[i]);
        }
        EXPECT_EQ(box.low, low) << name;
        EXPECT_EQ(box.high, high) << name;
    }
}

TEST(Seeds, FarthestPointOnALine) {
    // Points at x = 0, 1, 2, 3, 10: centroid 3.2, farthest 10; then 0; then 3 (distance 3 from 0, 7 from 10);
    // then 1 and 2 tie at 1.
    const std::vector<float> p = {0, 0, 0, 1, 0, 0, 2, 0, 0, 3, 0, 0, 10, 0, 0};
    EXPECT_EQ(farthest_point_seeds({p.data(), 1, 5}, 4), (std::vector<std::int32_t>{4, 0, 3, 1}));
    EXPECT_EQ(farthest_point_seeds({p.data(), 1, 5}, 99).size(), 5u);
}

TEST(Seeds, CoincidentPointsGiveOneSeed) {
    const std::vector<float> p(12, 1.5f);
    EXPECT_EQ(farthest_point_seeds({p.data(), 1, 4}, 3).size(), 1u);
}

TEST(SeedTriangle, TakesTheLargestSmallestArea) {
    // Two triangles at vertex 0; {0,1,2} is larger in the first frame and collapses in the second.
    const std::vector<float> p = {0, 0, 0, 4, 0, 0, 0, 4, 0, -1, 0, 0, 0, -1, 0,  //
                                  0, 0, 0, 4, 0, 0, 8, 0, 0, -1, 0, 0, 0, -1, 0};
    const std::vector<Triangle> triangles = {{0, 1, 2}, {0, 3, 4}};
    const std::vector<std::int32_t> seeds = {0};
    const auto chosen = choose_seed_triangles({p.data(), 2, 5}, triangles, seeds, SerialExecutor());
    EXPECT_EQ(chosen[0].vertices, (Triangle{0, 3, 4}));
    EXPECT_FALSE(chosen[0].replaced);
    EXPECT_FALSE(chosen[0].degenerate);
}

TEST(SeedTriangle, LooksElsewhereWhenAllCollapse) {
    const std::vector<float> p = {
        0, 0, 0, 4, 0, 0, 0, 4, 0, 5, 5, 0, 6, 5, 0, 5, 6, 0, 90, 90, 0, 99, 90, 0, 90, 99, 0,  //
        0, 0, 0, 4, 0, 0, 8, 0, 0, 5, 5, 0, 6, 5, 0, 5, 6, 0, 90, 90, 0, 99, 90, 0, 90, 99, 0};
    const std::vector<Triangle> triangles = {{0, 1, 2}, {6, 7, 8}, {3, 4, 5}};
    const std::vector<std::int32_t> seeds = {0};
    const auto chosen = choose_seed_triangles({p.data(), 2, 9}, triangles, seeds, SerialExecutor());
    EXPECT_EQ(chosen[0].vertices, (Triangle{3, 4, 5})) << "the usable triangle nearest to vertex 0";
    EXPECT_TRUE(chosen[0].replaced);
}

TEST(SeedTriangle, SaysWhenNothingIsUsable) {
    const std::vector<float> p = {0, 0, 0, 1, 0, 0, 2, 0, 0};
    const std::vector<Triangle> triangles = {{0, 1, 2}};
    const std::vector<std::int32_t> seeds = {0};
    EXPECT_TRUE(choose_seed_triangles({p.data(), 1, 3}, triangles, seeds, SerialExecutor())[0].degenerate);
}

TEST(SeedTriangle, PointsTakeTheBestOfTheirNeighbours) {
    const std::vector<float> p = {0, 0, 0, 1, 0, 0, 2, 0.01f, 0, 0, 1.5f, 0};
    const std::vector<std::int32_t> seeds = {0};
    const auto chosen = choose_seed_triangles({p.data(), 1, 4}, {}, seeds, SerialExecutor());
    EXPECT_EQ(chosen[0].vertices, (Triangle{0, 3, 2})) << "the largest area: base 2, height 1.5";
    EXPECT_FALSE(chosen[0].replaced);
}

TEST(SeedTriangle, IsDefinedForEveryKindOfClip) {
    for (const auto& [name, clip] : test::every_kind_of_clip()) {
        const auto seeds = farthest_point_seeds(clip.view().frames(0, 1), 5);
        for (const SeedTriangle& t :
             choose_seed_triangles(clip.view(), clip.triangles, seeds, SerialExecutor())) {
            for (const std::int32_t v : t.vertices) {
                EXPECT_GE(v, 0) << name;
                EXPECT_LT(v, clip.vertex_count) << name;
            }
        }
    }
}

}  // namespace
}  // namespace batchenc
