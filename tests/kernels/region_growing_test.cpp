#include "kernels/region_growing.h"

#include <gtest/gtest.h>

#include "tests/support/sample_clips.h"

namespace batchenc {
namespace {

std::vector<std::int32_t> grow(const MeshSequence& clip, const std::vector<std::int32_t>& seeds,
                               const std::vector<Triangle>& seed_triangles) {
    const VertexTriangles vertex_triangles(clip.triangles, clip.vertex_count);
    return grow_regions(mean_positions(clip.view(), SerialExecutor()), clip.triangles, vertex_triangles,
                        seeds, seed_triangles);
}

/// A strip of 2 × n vertices: 0 … n-1 below, n … 2n-1 above.
MeshSequence strip(std::int64_t n) {
    return test::sheet(n, 2, 3, [](const std::array<double, 3>& p, double) { return p; });
}

TEST(RegionGrowing, MeansAreOverTime) {
    const MeshSequence clip =
        test::animate({{1, 2, 3}}, {}, 3, [](const std::array<double, 3>& p, double time) {
            return std::array<double, 3>{p[0] + time, p[1], p[2] - 4.0 * time};
        });
    EXPECT_EQ(mean_positions(clip.view(), SerialExecutor()), (std::vector<float>{1.5f, 2.0f, 1.0f}));
}

TEST(RegionGrowing, TwoRegionsMeetInTheMiddleOfAStrip) {
    // Triangles of cell x: (x, x+1, x+11) and (x, x+11, x+10). Regions start at both ends and take turns.
    const MeshSequence clip = strip(10);
    const auto labels = grow(clip, {0, 9}, {{0, 11, 10}, {8, 9, 19}});
    for (std::size_t v = 0; v < 20; ++v) {
        if (v % 10 <= 3) {
            EXPECT_EQ(labels[v], 0) << v;
        }
        if (v % 10 >= 6) {
            EXPECT_EQ(labels[v], 1) << v;
        }
    }
    EXPECT_EQ(std::count(labels.begin(), labels.end(), 0), 10);
}

TEST(RegionGrowing, OneRegionTakesAll) {
    const MeshSequence clip = strip(10);
    EXPECT_EQ(grow(clip, {0}, {{0, 1, 11}}), std::vector<std::int32_t>(20, 0));
}

TEST(RegionGrowing, UnreachedComponentsGoToTheNearestSeedAsAWhole) {
    // A strip, and two triangles apart that no seed is in: one near each end, and a lone vertex.
    MeshSequence clip = strip(10);
    std::vector<std::array<double, 3>> rest;
    for (std::int64_t v = 0; v < 20; ++v) {
        const float* p = clip.view().at(0, v);
        rest.push_back({p[0], p[1], p[2]});
    }
    for (const double x : {-1.0, 1.8})
        for (int k = 0; k < 3; ++k) rest.push_back({x + 0.1 * k, 2.0, 0.1 * k * k});
    rest.push_back({1.5, 0.0, 0.0});
    std::vector<Triangle> triangles = clip.triangles;
    triangles.push_back({20, 21, 22});
    triangles.push_back({23, 24, 25});
    clip = test::animate(rest, triangles, 2, [](const std::array<double, 3>& p, double) { return p; });
    const auto labels = grow(clip, {0, 9}, {{0, 1, 11}, {8, 9, 19}});
    EXPECT_EQ(std::vector<std::int32_t>(labels.begin() + 20, labels.end()),
              (std::vector<std::int32_t>{0, 0, 0, 1, 1, 1, 1}));
}

TEST(RegionGrowing, PointsGoToTheNearestSeed) {
    const MeshSequence clip =
        test::animate({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {7, 0, 0}, {9, 0, 0}, {10, 0, 0}}, {}, 2,
                      [](const std::array<double, 3>& p, double) { return p; });
    EXPECT_EQ(grow(clip, {0, 5}, {{0, 0, 0}, {5, 5, 5}}), (std::vector<std::int32_t>{0, 0, 0, 1, 1, 1}));
}

}  // namespace
}  // namespace batchenc
