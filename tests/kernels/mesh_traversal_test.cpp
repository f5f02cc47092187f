#include "kernels/mesh_traversal.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/sample_clips.h"

namespace batchenc {
namespace {

TEST(MeshTraversal, HandWorkedFan) {
    // Four triangles around vertex 0; 5 has no triangle.
    const std::vector<Triangle> triangles = {{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 1}};
    const MeshTraversal traversal = MeshTraversal::of(triangles, 6);
    // 0, 1, 2 begin. 4 waits since 1 (over 0-1), 3 since 2 (over 0-2); 4 makes 3's second triangle ready.
    EXPECT_EQ(traversal.order, (std::vector<std::int32_t>{0, 1, 2, 4, 3, 5}));
    // Anchors and gates by place: the vertex 4 has place 3, and 3 has 4.
    EXPECT_EQ(traversal.anchor, (std::vector<std::int32_t>{-1, 0, 1, 2, 3, 4}));
    const auto gates = [&](std::size_t place) {
        std::vector<std::array<std::int32_t, 3>> found;
        for (const Gate& g : traversal.gates_of(place)) found.push_back({g.left, g.right, g.opposite});
        return found;
    };
    using Gates = std::vector<std::array<std::int32_t, 3>>;
    EXPECT_EQ(gates(0), Gates{});
    EXPECT_EQ(gates(1), Gates{});
    EXPECT_EQ(gates(2), (Gates{{0, 1, -1}})) << "an edge, and no triangle behind it";
    EXPECT_EQ(gates(3), (Gates{{1, 0, 2}}));
    EXPECT_EQ(gates(4), (Gates{{0, 2, 1}, {3, 0, 1}}));
    EXPECT_EQ(traversal.gates_of(3)[0].triangle, 0);
    EXPECT_EQ(traversal.gates_of(4)[1].triangle, 3);
    EXPECT_EQ(traversal.in_places(triangles)[2], (Triangle{0, 4, 3}));
    EXPECT_EQ(gates(5), Gates{});
}

TEST(MeshTraversal, VisitsEveryVertexOnceAndPredictsFromTheVisited) {
    for (const auto& [name, clip] : test::every_kind_of_clip()) {
        const MeshTraversal traversal = MeshTraversal::of(clip.triangles, clip.vertex_count);
        const auto count = static_cast<std::size_t>(clip.vertex_count);
        ASSERT_EQ(traversal.order.size(), count) << name;
        ASSERT_EQ(traversal.anchor.size(), count) << name;
        ASSERT_EQ(traversal.first_gate.size(), count + 1) << name;
        std::vector<std::int64_t> place(count, -1);
        for (std::size_t k = 0; k < count; ++k) {
            const std::int32_t v = traversal.order[k];
            ASSERT_EQ(place[static_cast<std::size_t>(v)], -1) << name << ": twice " << v;
            const auto is_known = [&](std::int32_t at) {
                return at >= 0 && at < static_cast<std::int32_t>(k);
            };
            place[static_cast<std::size_t>(v)] = static_cast<std::int64_t>(k);
            EXPECT_EQ(traversal.anchor[k] < 0, k == 0) << name;
            if (k > 0) {
                EXPECT_TRUE(is_known(traversal.anchor[k])) << name;
            }
            EXPECT_LE(traversal.gates_of(k).size(), MeshTraversal::kMostGates) << name;
            for (const Gate& gate : traversal.gates_of(k)) {
                EXPECT_TRUE(is_known(gate.left) && is_known(gate.right)) << name;
                EXPECT_NE(gate.left, gate.right) << name;
                if (gate.opposite < 0) {
                    EXPECT_EQ(traversal.gates_of(k).size(), 1u) << name;
                } else {
                    EXPECT_TRUE(is_known(gate.opposite)) << name;
                    EXPECT_TRUE(gate.opposite != gate.left && gate.opposite != gate.right) << name;
                }
            }
        }
    }
}

TEST(MeshTraversal, NearlyAllVerticesOfASurfaceHaveGates) {
    const MeshSequence clip = test::sheet(30, 30, 1);
    const MeshTraversal traversal = MeshTraversal::of(clip.triangles, clip.vertex_count);
    int with_gate = 0, with_several = 0;
    for (std::size_t k = 0; k < traversal.order.size(); ++k) {
        const auto gates = traversal.gates_of(k);
        with_gate += !gates.empty() && gates[0].opposite >= 0;
        with_several += gates.size() > 1;
    }
    EXPECT_EQ(with_gate, 900 - 3) << "one triangle begins";
    EXPECT_GT(with_several, 700) << "those that can be predicted from several sides come first";
}

}  // namespace
}  // namespace batchenc
