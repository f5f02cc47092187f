#include "core/mesh_sequence.h"

#include <gtest/gtest.h>

#include <numeric>

namespace batchenc {
namespace {

constexpr std::int64_t kFrames = 4;
constexpr std::int64_t kVertices = 5;

/// Every coordinate holds its own index, so that a transposition shows.
MeshSequence numbered_sequence() {
    MeshSequence sequence;
    sequence.frame_count = kFrames;
    sequence.vertex_count = kVertices;
    sequence.positions.resize(kFrames * kVertices * 3);
    std::iota(sequence.positions.begin(), sequence.positions.end(), 0.0f);
    return sequence;
}

TEST(PositionsView, AddressesFrameVertexCoordinate) {
    const MeshSequence sequence = numbered_sequence();
    const PositionsView view = sequence.view();
    EXPECT_EQ(view.value_count(), kFrames * kVertices * 3);
    EXPECT_EQ(view.size_bytes(), kFrames * kVertices * 12);
    for (std::int64_t f = 0; f < kFrames; ++f) {
        for (std::int64_t v = 0; v < kVertices; ++v) {
            for (std::int64_t axis = 0; axis < 3; ++axis) {
                const auto expected = static_cast<float>((f * kVertices + v) * 3 + axis);
                EXPECT_EQ(view.at(f, v)[axis], expected);
            }
        }
    }
}

TEST(PositionsView, CutsFramesWithoutCopying) {
    const MeshSequence sequence = numbered_sequence();
    const PositionsView part = sequence.view().frames(1, 3);
    EXPECT_EQ(part.frame_count(), 2);
    EXPECT_EQ(part.vertex_count(), kVertices);
    EXPECT_EQ(part.data(), sequence.view().at(1, 0));
    EXPECT_EQ(sequence.view().frames(2, 2).value_count(), 0);
}

TEST(PositionsView, StartsEmpty) {
    EXPECT_EQ(PositionsView().value_count(), 0);
    EXPECT_EQ(PositionsView().data(), nullptr);
}

TEST(MutablePositionsView, WritesThrough) {
    MeshSequence sequence = numbered_sequence();
    MutablePositionsView view = sequence.view();
    view.at(2, 3)[1] = -7.0f;
    view.at(3, 4)[2] = -8.0f;
    EXPECT_EQ(sequence.positions[(2 * kVertices + 3) * 3 + 1], -7.0f);
    EXPECT_EQ(sequence.positions.back(), -8.0f);
    const PositionsView read = view;
    EXPECT_EQ(read.data(), view.data());
    EXPECT_EQ(read.value_count(), kFrames * kVertices * 3);
}

}  // namespace
}  // namespace batchenc
