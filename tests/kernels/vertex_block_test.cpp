#include "kernels/vertex_block.h"

#include <gtest/gtest.h>

#include "kernels/variation.h"
#include "kernels/vertex_triangles.h"
#include "tests/support/sample_clips.h"

namespace batchenc {
namespace {

TEST(VertexBlocks, HoldEveryCoordinateOnce) {
    for (const auto& [name, clip] : test::every_kind_of_clip()) {
        const VertexBlocks blocks(clip.view(), ShuffledExecutor(3));
        ASSERT_EQ(blocks.count(), (clip.vertex_count + 31) / 32) << name;
        for (std::int64_t f = 0; f < clip.frame_count; ++f) {
            for (std::int64_t v = 0; v < blocks.count() * kVertexBlock; ++v) {
                const float* p = clip.view().at(f, std::min(v, clip.vertex_count - 1));
                const float* block = blocks.block(v / kVertexBlock) + f * 3 * kVertexBlock + v % kVertexBlock;
                for (std::int64_t axis = 0; axis < 3; ++axis)
                    ASSERT_EQ(block[axis * kVertexBlock], p[axis])
                        << name << " frame " << f << " vertex " << v;
            }
        }
    }
}

TEST(VertexBlock, GathersAnyVertices) {
    const MeshSequence clip = test::sheet(9, 5, 7);
    AlignedFloats block(vertex_block_size(7));
    const std::vector<std::int32_t> vertices = {44, 0, 13};
    gather_vertex_block(clip.view(), vertices, block.data());
    for (std::int64_t f = 0; f < 7; ++f) {
        for (std::int64_t k = 0; k < kVertexBlock; ++k) {
            const float* p =
                clip.view().at(f, vertices[static_cast<std::size_t>(std::min<std::int64_t>(k, 2))]);
            EXPECT_EQ(block.data()[(3 * f + 1) * kVertexBlock + k], p[1]);
        }
    }
}

TEST(VertexTriangles, ListsTheTrianglesOfEachVertex) {
    const std::vector<Triangle> triangles = {{0, 1, 2}, {2, 1, 4}, {4, 4, 0}};
    const VertexTriangles of_vertex(triangles, 6);
    const auto list = [&](std::int32_t v) {
        const auto found = of_vertex.of(v);
        return std::vector<std::int32_t>(found.begin(), found.end());
    };
    EXPECT_EQ(list(0), (std::vector<std::int32_t>{0, 2}));
    EXPECT_EQ(list(1), (std::vector<std::int32_t>{0, 1}));
    EXPECT_EQ(list(2), (std::vector<std::int32_t>{0, 1}));
    EXPECT_EQ(list(3), (std::vector<std::int32_t>{}));
    EXPECT_EQ(list(4), (std::vector<std::int32_t>{1, 2, 2}));
    EXPECT_EQ(list(5), (std::vector<std::int32_t>{}));
}

/// The definition in double precision: variation and mean of q.
std::array<double, 4> variation_of(PositionsView positions, std::int64_t vertex,
                                   const LocalFrameTrack& track) {
    std::array<double, 4> found{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
        std::vector<double> q;
        for (std::int64_t f = 0; f < positions.frame_count(); ++f) {
            double value = 0.0;
            for (std::size_t c = 0; c < 3; ++c)
                value += static_cast<double>(track.row(static_cast<int>(3 * axis + c))[f]) *
                         (static_cast<double>(positions.at(f, vertex)[c]) -
                          static_cast<double>(track.row(static_cast<int>(9 + c))[f]));
            q.push_back(value);
            found[1 + axis] += value / static_cast<double>(positions.frame_count());
        }
        for (const double value : q) found[0] += (value - found[1 + axis]) * (value - found[1 + axis]);
    }
    return found;
}

TEST(Variation, AgreesWithTheDefinition) {
    for (const std::int64_t frames : {1, 2, 17, 200}) {
        const MeshSequence clip = test::sheet(9, 5, frames);
        const std::vector<LocalFrameTrack> tracks = {triangle_track(clip.view(), {0, 4, 20}),
                                                     triangle_track(clip.view(), {44, 30, 8})};
        const VertexBlocks blocks(clip.view(), SerialExecutor());
        std::vector<float> rows(2 * kVariationRows * kVertexBlock);
        for (std::int64_t v = 0; v < clip.vertex_count; ++v) {
            variation_block(blocks.block(v / kVertexBlock), frames, tracks, rows);
            for (std::size_t i = 0; i < 2; ++i) {
                const auto expected = variation_of(clip.view(), v, tracks[i]);
                const float* got = rows.data() + i * kVariationRows * kVertexBlock + v % kVertexBlock;
                ASSERT_NEAR(got[0], expected[0], 1e-4 * expected[0] + 1e-9) << frames << " " << v << " " << i;
                for (std::size_t axis = 1; axis < 4; ++axis)
                    ASSERT_NEAR(got[axis * kVertexBlock], expected[axis], 1e-5) << frames << " " << v;
            }
        }
    }
}

}  // namespace
}  // namespace batchenc
