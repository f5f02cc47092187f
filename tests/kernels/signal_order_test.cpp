#include "kernels/signal_order.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "tests/support/sample_clips.h"

namespace batchenc {
namespace {

TEST(WalkCluster, HandWorked) {
    // Two triangles, and 4 alone. After 0 and 1, vertex 2 has no unvisited neighbour in its list and 3 has
    // one: 2 comes first, and back at 1 there is 3.
    const std::vector<Triangle> triangles = {{0, 1, 2}, {2, 1, 3}};
    const auto adjacency = MeshAdjacency::of(triangles, 5);
    const std::vector<std::int32_t> owner(5, 0), members = {0, 1, 2, 3, 4};
    std::vector<std::int32_t> position(5, -1);
    const auto walk = walk_cluster(adjacency, members, owner, 0, position);
    EXPECT_EQ(walk.vertices, (std::vector<std::int32_t>{0, 1, 2, 3, 4}));
    EXPECT_EQ(position, (std::vector<std::int32_t>{0, 1, 2, 3, 4}));
    EXPECT_EQ(walk.predecessor_count, (std::vector<std::uint8_t>{0, 0, 2, 1, 0}));
}

TEST(WalkCluster, VisitsEachMemberOnceAndStaysNearby) {
    for (const auto& [name, clip] : test::every_kind_of_clip()) {
        const auto adjacency = MeshAdjacency::of(clip.triangles, clip.vertex_count);
        std::vector<std::int32_t> owner(static_cast<std::size_t>(clip.vertex_count), 0);
        std::vector<std::int32_t> position(owner.size(), -1), members(owner.size());
        std::iota(members.begin(), members.end(), 0);
        const auto walk = walk_cluster(adjacency, members, owner, 0, position);
        auto sorted = walk.vertices;
        std::sort(sorted.begin(), sorted.end());
        EXPECT_EQ(sorted, members) << name;
        for (std::size_t k = 0; k < walk.vertices.size(); ++k) {
            EXPECT_EQ(position[static_cast<std::size_t>(walk.vertices[k])], static_cast<std::int32_t>(k));
            for (std::size_t p = 0; p < walk.predecessor_count[k]; ++p)
                EXPECT_LT(walk.predecessors[k * ClusterTraversal::kMaxPredecessors + p],
                          static_cast<std::int32_t>(k));
        }
    }
}

TEST(CurveOrder, GoesThroughTheCornersOfACubeAlongItsEdges) {
    std::vector<float> corners;
    for (int k = 0; k < 8; ++k) {
        for (int c = 0; c < 3; ++c) corners.push_back(static_cast<float>(k >> c & 1));
    }
    const auto order = curve_order(corners);
    auto sorted = order;
    std::sort(sorted.begin(), sorted.end());
    EXPECT_EQ(sorted, (std::vector<std::int32_t>{0, 1, 2, 3, 4, 5, 6, 7}));
    for (std::size_t k = 1; k < order.size(); ++k)
        EXPECT_EQ(__builtin_popcount(static_cast<unsigned>(order[k] ^ order[k - 1])), 1) << k;
}

TEST(CurveOrder, TakesWhatHasNoExtent) {
    const std::vector<std::int32_t> identity = {0, 1, 2};
    EXPECT_TRUE(curve_order({}).empty());
    EXPECT_EQ(curve_order(std::vector<float>(9, 2.0f)), identity);
    std::vector<float> broken = {0, 0, 0, 1, 1, 1, 2, 2, std::numeric_limits<float>::quiet_NaN()};
    EXPECT_EQ(curve_order(broken), identity);
    broken[8] = std::numeric_limits<float>::infinity();
    EXPECT_EQ(curve_order(broken), identity);
}

}  // namespace
}  // namespace batchenc
