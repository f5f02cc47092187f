#include "pipeline/vertex_order.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "tests/support/sample_meshes.h"

namespace batchenc {
namespace {

// Frame f has vertex v at (100 f + v, -v, v / 2).
std::vector<float> numbered_frames(std::int64_t frame_count, std::int64_t vertex_count) {
    std::vector<float> positions;
    for (std::int64_t f = 0; f < frame_count; ++f) {
        for (std::int64_t v = 0; v < vertex_count; ++v)
            positions.insert(positions.end(), {static_cast<float>(100 * f + v), static_cast<float>(-v),
                                               0.5F * static_cast<float>(v)});
    }
    return positions;
}

TEST(VertexOrder, TakesEveryVertexFromItsSource) {
    auto positions = numbered_frames(3, 4);
    const std::vector<std::int32_t> sources = {2, 0, 3, 1};
    reorder_vertices({positions.data(), 3, 4}, sources, SerialExecutor());
    for (std::size_t f = 0; f < 3; ++f) {
        for (std::size_t v = 0; v < 4; ++v) {
            const float* p = &positions[3 * (4 * f + v)];
            EXPECT_EQ(p[0], static_cast<float>(100 * f) + static_cast<float>(sources[v])) << f << " " << v;
            EXPECT_EQ(p[1], static_cast<float>(-sources[v])) << f << " " << v;
            EXPECT_EQ(p[2], 0.5F * static_cast<float>(sources[v])) << f << " " << v;
        }
    }
}

TEST(VertexOrder, LeavesFramesAsTheyAreWithoutOne) {
    auto positions = numbered_frames(2, 5);
    reorder_vertices({positions.data(), 2, 5}, {}, SerialExecutor());
    EXPECT_EQ(positions, numbered_frames(2, 5));
}

TEST(VertexOrder, IsTheSameInAnyOrderOfTasks) {
    std::mt19937 generator(1);
    std::vector<std::int32_t> sources(50);
    std::iota(sources.begin(), sources.end(), 0);
    test::shuffle(sources, generator);
    auto expected = numbered_frames(40, 50);
    reorder_vertices({expected.data(), 40, 50}, sources, SerialExecutor());
    for (std::uint64_t seed = 0; seed < 5; ++seed) {
        auto positions = numbered_frames(40, 50);
        reorder_vertices({positions.data(), 40, 50}, sources, ShuffledExecutor(seed));
        EXPECT_EQ(positions, expected);
    }
    // The way back.
    std::vector<std::int32_t> back(sources.size());
    for (std::size_t v = 0; v < sources.size(); ++v)
        back[static_cast<std::size_t>(sources[v])] = static_cast<std::int32_t>(v);
    reorder_vertices({expected.data(), 40, 50}, back, SerialExecutor());
    EXPECT_EQ(expected, numbered_frames(40, 50));
}

}  // namespace
}  // namespace batchenc
