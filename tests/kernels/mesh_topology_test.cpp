#include "kernels/mesh_topology.h"

#include <gtest/gtest.h>

#include <barrier>
#include <thread>

#include "tests/support/sample_clips.h"

namespace batchenc {
namespace {

void expect_same(const MeshAdjacency& found, const MeshAdjacency& expected, const std::string& name) {
    EXPECT_EQ(found.first, expected.first) << name;
    EXPECT_EQ(found.neighbours, expected.neighbours) << name;
}

void expect_same(const MeshTraversal& found, const MeshTraversal& expected, const std::string& name) {
    EXPECT_EQ(found.order, expected.order) << name;
    EXPECT_EQ(found.first_gate, expected.first_gate) << name;
    EXPECT_EQ(found.anchor, expected.anchor) << name;
    ASSERT_EQ(found.gates.size(), expected.gates.size()) << name;
    for (std::size_t i = 0; i < found.gates.size(); ++i) {
        const Gate &a = found.gates[i], &b = expected.gates[i];
        EXPECT_EQ(std::tie(a.left, a.right, a.opposite, a.triangle),
                  std::tie(b.left, b.right, b.opposite, b.triangle))
            << name << ", gate " << i;
    }
}

void expect_same(const Surface& found, const Surface& expected, const std::string& name) {
    EXPECT_EQ(found.triangles, expected.triangles) << name;
    EXPECT_EQ(found.is_flipped, expected.is_flipped) << name;
    EXPECT_EQ(found.twin, expected.twin) << name;
    EXPECT_EQ(found.fan, expected.fan) << name;
    EXPECT_EQ(found.fan_size, expected.fan_size) << name;
    EXPECT_EQ(found.fan_is_open, expected.fan_is_open) << name;
}

// Every derived part against the function that it is to keep the result of.
void expect_sound(const MeshTopology& mesh, const MeshSequence& clip, const std::string& name) {
    EXPECT_EQ(mesh.triangles(), clip.triangles) << name;
    EXPECT_EQ(mesh.vertex_count(), clip.vertex_count) << name;
    EXPECT_EQ(mesh.is_points(), clip.triangles.empty()) << name;
    const MeshTraversal traversal = MeshTraversal::of(clip.triangles, clip.vertex_count);
    expect_same(mesh.adjacency(), MeshAdjacency::of(clip.triangles, clip.vertex_count), name);
    expect_same(mesh.traversal(), traversal, name);
    expect_same(mesh.surface(), Surface::of(traversal.in_places(clip.triangles)), name);
}

TEST(MeshTopology, KeepsWhatIsDerivedFromEveryKindOfMesh) {
    for (const auto& [name, clip] : test::every_kind_of_clip()) {
        const MeshTopology mesh(clip.triangles, clip.vertex_count);
        expect_sound(mesh, clip, name);
        const MeshAdjacency* adjacency = &mesh.adjacency();
        const MeshTraversal* traversal = &mesh.traversal();
        const Surface* surface = &mesh.surface();
        expect_sound(mesh, clip, name);  // asked again
        EXPECT_EQ(&mesh.adjacency(), adjacency);
        EXPECT_EQ(&mesh.traversal(), traversal);
        EXPECT_EQ(&mesh.surface(), surface);
    }
}

TEST(MeshTopology, PointsHaveNoNeighboursAndStillAnOrder) {
    const MeshTopology points({}, 5);
    EXPECT_TRUE(points.is_points());
    EXPECT_EQ(points.adjacency().first, (std::vector<std::int32_t>(6, 0)));
    EXPECT_TRUE(points.adjacency().neighbours.empty());
    EXPECT_EQ(points.traversal().order, (std::vector<std::int32_t>{0, 1, 2, 3, 4}));
    EXPECT_TRUE(points.surface().triangles.empty());
}

// All ask at once, each for another part first: nobody may see one that is half made. Under the thread
// sanitizer this is the test of the promise that any thread may ask.
TEST(MeshTopology, ManyThreadsAskAtOnce) {
    constexpr int kThreads = 6, kRounds = 5;
    MeshSequence sheet = test::sheet(40, 30, 1), points = sheet;
    points.triangles.clear();
    for (const MeshSequence& clip : {sheet, points}) {
        for (int round = 0; round < kRounds; ++round) {
            const MeshTopology mesh(clip.triangles, clip.vertex_count);
            std::barrier start(kThreads);
            std::vector<std::thread> threads;
            for (int thread = 0; thread < kThreads; ++thread) {
                threads.emplace_back([&, thread] {
                    start.arrive_and_wait();
                    // What each first asks for is all there when it is given.
                    if (thread % 3 == 0) {
                        EXPECT_EQ(mesh.surface().twin.size(), 3 * clip.triangles.size());
                    } else if (thread % 3 == 1) {
                        EXPECT_EQ(mesh.traversal().order.size(), static_cast<std::size_t>(clip.vertex_count));
                    } else {
                        EXPECT_EQ(mesh.adjacency().neighbours.size(), 3 * clip.triangles.size());
                    }
                    expect_sound(mesh, clip, "thread " + std::to_string(thread));
                });
            }
            for (std::thread& thread : threads) thread.join();
        }
    }
}

}  // namespace
}  // namespace batchenc
