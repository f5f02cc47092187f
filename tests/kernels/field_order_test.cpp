#include "kernels/field_order.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "kernels/mesh_topology.h"
#include "kernels/signal_order.h"
#include "tests/support/sample_clips.h"

namespace batchenc {
namespace {

using Places = std::vector<std::int32_t>;

Places neighbours_of(const FieldOrder& order, std::size_t place) {
    return {order.neighbours.begin() + order.first_neighbour[place],
            order.neighbours.begin() + order.first_neighbour[place + 1]};
}

TEST(FieldOrder, HandWorked) {
    const MeshTopology mesh({{0, 1, 2}, {2, 1, 3}}, 5);
    const std::vector<std::int32_t> one(5, 0);
    const auto whole = FieldOrder::of(mesh, one, 1);
    ASSERT_EQ(whole.size(), 1u);
    EXPECT_EQ(whole[0].vertices, (Places{0, 1, 2, 3, 4}));
    EXPECT_EQ(whole[0].first_gate, (Places{0, 0, 0, 0, 1, 1}));
    ASSERT_EQ(whole[0].gates.size(), 1u);
    EXPECT_EQ(whole[0].gates[0], (std::array<std::int32_t, 3>{2, 1, 0}));  // 3 ~ 2 + 1 - 0
    EXPECT_EQ(whole[0].first_neighbour, (Places{0, 0, 1, 3, 5, 5}));
    EXPECT_EQ(whole[0].neighbours, (Places{0, 0, 1, 1, 2}));

    // Vertex 2 in a cluster of its own takes the gate with it.
    const std::vector<std::int32_t> two = {0, 0, 2, 0, 0};
    const auto parts = FieldOrder::of(mesh, two, 3);
    EXPECT_EQ(parts[0].vertices, (Places{0, 1, 3, 4}));
    EXPECT_TRUE(parts[0].gates.empty());
    EXPECT_EQ(parts[0].neighbours, (Places{0, 1}));
    EXPECT_EQ(parts[0].first_neighbour, (Places{0, 0, 1, 2, 2}));
    EXPECT_EQ(parts[1].size(), 0);
    EXPECT_EQ(parts[1].first_gate, (Places{0}));
    EXPECT_EQ(parts[2].vertices, (Places{2}));
    EXPECT_TRUE(parts[2].neighbours.empty());
}

TEST(FieldOrder, TakesTheFirstEightNeighbours) {
    // A strip, and a vertex that degenerate triangles join to all of it, so that it comes last.
    std::vector<Triangle> triangles;
    constexpr std::int32_t kStrip = 12;
    for (std::int32_t k = 0; k + 2 < kStrip; ++k) triangles.push_back({k, k + 1, k + 2});
    for (std::int32_t k = 0; k < kStrip; ++k) triangles.push_back({kStrip, kStrip, k});
    const MeshTopology mesh(triangles, kStrip + 1);
    const auto orders = FieldOrder::of(mesh, std::vector<std::int32_t>(kStrip + 1, 0), 1);
    EXPECT_EQ(orders[0].vertices.back(), kStrip);
    EXPECT_EQ(neighbours_of(orders[0], kStrip), (Places{0, 1, 2, 3, 4, 5, 6, 7}));
}

TEST(FieldOrder, HasEachVertexOnceAndLooksBackOnly) {
    for (const auto& [name, clip] : test::every_kind_of_clip()) {
        const MeshTopology mesh(clip.triangles, clip.vertex_count);
        std::vector<std::int32_t> labels(static_cast<std::size_t>(clip.vertex_count));
        for (std::size_t v = 0; v < labels.size(); ++v) labels[v] = static_cast<std::int32_t>(v / 7 % 3);
        const auto orders = FieldOrder::of(mesh, labels, 3);
        std::set<std::int32_t> seen;
        for (std::size_t i = 0; i < 3; ++i) {
            const FieldOrder& order = orders[i];
            ASSERT_EQ(order.first_gate.size(), order.vertices.size() + 1);
            ASSERT_EQ(order.first_neighbour.size(), order.vertices.size() + 1);
            for (std::size_t k = 0; k < order.vertices.size(); ++k) {
                const std::int32_t v = order.vertices[k];
                EXPECT_EQ(labels[static_cast<std::size_t>(v)], static_cast<std::int32_t>(i));
                EXPECT_TRUE(seen.insert(v).second) << name;
                EXPECT_LE(order.first_gate[k + 1] - order.first_gate[k],
                          static_cast<std::int32_t>(MeshTraversal::kMostGates));
                for (std::int32_t g = order.first_gate[k]; g < order.first_gate[k + 1]; ++g) {
                    for (const std::int32_t p : order.gates[static_cast<std::size_t>(g)]) {
                        EXPECT_GE(p, 0) << name;
                        EXPECT_LT(p, static_cast<std::int32_t>(k)) << name;
                    }
                }
                // By looking at all triangles.
                std::set<std::int32_t> around;
                for (const Triangle& t : clip.triangles) {
                    if (std::find(t.begin(), t.end(), v) != t.end()) around.insert(t.begin(), t.end());
                }
                Places expected;
                for (std::size_t p = 0; p < k && expected.size() < FieldOrder::kMostNeighbours; ++p) {
                    if (around.contains(order.vertices[p])) expected.push_back(static_cast<std::int32_t>(p));
                }
                EXPECT_EQ(neighbours_of(order, k), expected) << name << ", vertex " << v;
            }
        }
        EXPECT_EQ(seen.size(), labels.size()) << name;
    }
}

TEST(FieldOrder, GoesAlongTheCurveOfPoints) {
    const MeshSequence clip = test::sheet(9, 8, 1);
    std::vector<std::int32_t> labels(72);
    for (std::size_t v = 0; v < labels.size(); ++v) labels[v] = v % 5 == 0 ? 1 : 0;
    const auto orders = FieldOrder::along_curve(clip.positions, labels, 3);
    ASSERT_EQ(orders.size(), 3u);
    EXPECT_EQ(orders[0].size() + orders[1].size(), 72);
    EXPECT_EQ(orders[2].size(), 0);
    std::array<std::size_t, 3> at{};
    for (const std::int32_t v : curve_order(clip.positions)) {
        const auto i = static_cast<std::size_t>(labels[static_cast<std::size_t>(v)]);
        const auto k = static_cast<std::int32_t>(at[i]);
        EXPECT_EQ(orders[i].vertices[at[i]], v);
        const Places expected = k == 0 ? Places{} : k == 1 ? Places{0} : Places{k - 1, k - 2};
        EXPECT_EQ(neighbours_of(orders[i], at[i]), expected);
        ++at[i];
    }
    for (const FieldOrder& order : orders) {
        EXPECT_TRUE(order.gates.empty());
        EXPECT_EQ(order.first_gate, Places(order.vertices.size() + 1, 0));
    }
}

}  // namespace
}  // namespace batchenc
