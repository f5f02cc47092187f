#include "kernels/cluster_traversal.h"
#include "kernels/predecessor_prediction.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/sample_clips.h"

namespace batchenc {
namespace {

TEST(MeshAdjacency, HandWorked) {
    const std::vector<Triangle> triangles = {{0, 1, 2}, {2, 1, 3}};
    const auto adjacency = MeshAdjacency::of(triangles, 5);
    EXPECT_EQ(adjacency.first, (std::vector<std::int32_t>{0, 1, 3, 5, 6, 6}));
    EXPECT_EQ(adjacency.neighbours, (std::vector<std::int32_t>{1, 2, 3, 0, 1, 2}));
}

TEST(ClusterTraversal, VisitsEachMemberOnceAndPredictsFromEarlierNeighboursOnly) {
    for (const auto& [name, clip] : test::every_kind_of_clip()) {
        const auto adjacency = MeshAdjacency::of(clip.triangles, clip.vertex_count);
        std::vector<std::int32_t> owner(static_cast<std::size_t>(clip.vertex_count));
        for (std::size_t v = 0; v < owner.size(); ++v)
            owner[v] = static_cast<std::int32_t>(v % 7 == 0 ? 1 : 0);
        std::vector<std::int32_t> position(owner.size(), -1);
        for (const std::int32_t cluster : {0, 1}) {
            std::vector<std::int32_t> members;
            for (std::size_t v = 0; v < owner.size(); ++v) {
                if (owner[v] == cluster) members.push_back(static_cast<std::int32_t>(v));
            }
            const auto traversal = traverse_cluster(adjacency, members, owner, cluster, position);
            auto sorted = traversal.vertices;
            std::sort(sorted.begin(), sorted.end());
            EXPECT_EQ(sorted, members) << name;
            for (std::size_t k = 0; k < traversal.vertices.size(); ++k) {
                for (int p = 0; p < traversal.predecessor_count[k]; ++p) {
                    const std::int32_t before =
                        traversal.predecessors[k * ClusterTraversal::kMaxPredecessors +
                                               static_cast<std::size_t>(p)];
                    EXPECT_LT(before, static_cast<std::int32_t>(k)) << name;
                }
            }
        }
    }
}

TEST(ClusterTraversal, BreadthFirstAlongAStrip) {
    const MeshSequence strip = test::sheet(4, 2, 1);  // 0 1 2 3 over 4 5 6 7
    std::vector<std::int32_t> owner(8, 0), position(8, -1);
    const std::vector<std::int32_t> members = {0, 1, 2, 3, 4, 5, 6, 7};
    const auto traversal =
        traverse_cluster(MeshAdjacency::of(strip.triangles, 8), members, owner, 0, position);
    EXPECT_EQ(traversal.vertices.front(), 0);
    EXPECT_EQ(traversal.predecessor_count[0], 0);
    for (std::size_t k = 1; k < 8; ++k) EXPECT_GE(traversal.predecessor_count[k], 0);
    for (std::int32_t v = 0; v < 8; ++v)
        EXPECT_EQ(traversal.vertices[static_cast<std::size_t>(position[static_cast<std::size_t>(v)])], v);
}

TEST(PredictFromPredecessors, IsTheRoundedMean) {
    ClusterTraversal traversal;
    traversal.vertices = {0, 1, 2, 3, 4, 5};
    traversal.predecessors = {6, 6, 6, 6, 0, 6, 6, 6, 0, 1, 6, 6, 0, 1, 2, 6, 0, 1, 2, 3, 4, 4, 4, 4};
    traversal.predecessor_count = {0, 1, 2, 3, 4, 4};
    const std::int32_t big = 1 << 21;
    const std::vector<std::int32_t> column = {10,  -7, big, 21,   -14, big, 30, 100, big, 40, 3,
                                              big, -5, 5,   -big, 0,   0,   0,  0,   0,   0,  0};
    const std::array<std::array<std::int32_t, 3>, 6> expected = {{{0, 0, 0},
                                                                  {10, -7, big},
                                                                  {16, -10, big},  // 15.5 and -10.5 to even
                                                                  {20, 26, big},   // 20.33 and 26.33
                                                                  {25, 20, big},   // 25.25 and 20.5 to even
                                                                  {-5, 5, -big}}};
    for (std::size_t v = 0; v < 6; ++v) {
        std::array<std::int32_t, 4> predicted;
        predict_from_predecessors(traversal, column.data(), v, predicted.data());
        for (std::size_t c = 0; c < 3; ++c) EXPECT_EQ(predicted[c], expected[v][c]) << v << " " << c;
    }
}

}  // namespace
}  // namespace batchenc
