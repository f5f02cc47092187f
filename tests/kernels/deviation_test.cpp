#include "kernels/deviation.h"

#include <gtest/gtest.h>

#include "kernels/deviation_column.h"
#include "tests/support/sample_clips.h"

namespace batchenc {
namespace {

/// Tracks that turn and travel, one a cluster.
std::vector<LocalFrameTrack> make_tracks(std::int64_t clusters, std::int64_t frames) {
    std::vector<LocalFrameTrack> tracks;
    for (std::int64_t i = 0; i < clusters; ++i) {
        LocalFrameTrack track(frames);
        for (std::int64_t f = 0; f < frames; ++f) {
            const double a =
                0.3 * static_cast<double>(i + 1) * static_cast<double>(f) / static_cast<double>(frames);
            const std::array<double, 3> p1 = {static_cast<double>(i), a, 0.0};
            track.set(f, local_frame(p1, {p1[0] + std::cos(a), p1[1] + std::sin(a), 0.1},
                                     {p1[0], p1[1] + 1.0, 1.0 + a}, {}));
        }
        tracks.push_back(std::move(track));
    }
    return tracks;
}

/// (4.1) as it stands, in double precision.
double theta_of(PositionsView positions, std::int64_t vertex, const LocalFrameTrack& track) {
    double sum = 0.0;
    std::array<double, 3> before{};
    for (std::int64_t f = 0; f < positions.frame_count(); ++f) {
        const float* p = positions.at(f, vertex);
        for (int axis = 0; axis < 3; ++axis) {
            double q = 0.0;
            for (int c = 0; c < 3; ++c)
                q += static_cast<double>(track.row(3 * axis + c)[f]) *
                     (static_cast<double>(p[c]) - track.row(9 + c)[f]);
            if (f > 0)
                sum += (q - before[static_cast<std::size_t>(axis)]) *
                       (q - before[static_cast<std::size_t>(axis)]);
            before[static_cast<std::size_t>(axis)] = q;
        }
    }
    return sum;
}

TEST(Deviation, AgreesWithTheDefinition) {
    for (const std::int64_t frames :
         {1, 2, 3, 17, 48, 49, 50, 97, 200}) {                // around the kernel's run of frames
        const MeshSequence clip = test::sheet(9, 5, frames);  // 45 vertices: one whole block and a part
        const auto tracks = make_tracks(3, frames);
        const VertexBlocks blocks(clip.view(), SerialExecutor());
        std::vector<float> theta(3 * kVertexBlock);
        for (std::int64_t first = 0; first < clip.vertex_count; first += kVertexBlock) {
            deviation_block(blocks.block(first / kVertexBlock), frames, tracks, theta);
            for (std::int64_t v = first; v < std::min(first + kVertexBlock, clip.vertex_count); ++v) {
                for (std::size_t i = 0; i < 3; ++i) {
                    const double expected = theta_of(clip.view(), v, tracks[i]);
                    const double got = theta[i * kVertexBlock + static_cast<std::size_t>(v - first)];
                    ASSERT_NEAR(got, expected, 1e-4 * expected + 1e-9)
                        << "frames " << frames << " vertex " << v << " cluster " << i;
                }
            }
        }
    }
}

TEST(Deviation, IsZeroForVerticesThatMoveWithTheirFrame) {
    const MeshSequence clip = test::sheet(4, 4, 10, [](const std::array<double, 3>& p, double time) {
        return std::array<double, 3>{p[0] + 4.0 * time, p[1], p[2]};
    });
    LocalFrameTrack track(10);
    for (std::int64_t f = 0; f < 10; ++f) {
        const auto corner = [&](std::int64_t v) {
            const float* p = clip.view().at(f, v);
            return std::array<double, 3>{p[0], p[1], p[2]};
        };
        track.set(f, local_frame(corner(0), corner(1), corner(4), {}));
    }
    const VertexBlocks blocks(clip.view(), SerialExecutor());
    std::vector<float> theta(kVertexBlock);
    deviation_block(blocks.block(0), 10, std::span(&track, 1), theta);
    for (std::size_t v = 0; v < 16; ++v) EXPECT_LT(theta[v], 1e-10f);
}

TEST(DeviationColumn, StopsAtItsLimitsAndGoesOnWhereItStopped) {
    constexpr std::int64_t kFrames = 100;
    const MeshSequence clip = test::sheet(9, 5, kFrames);
    const VertexBlocks blocks(clip.view(), SerialExecutor());
    const LocalFrameTrack track = make_tracks(1, kFrames)[0];
    const auto theta = [&](std::int64_t v) { return theta_of(clip.view(), v, track); };

    DeviationColumn column(blocks, track);
    std::vector<float> limits(kVertexBlock, 0.0f);
    column.extend(0, limits.data());
    EXPECT_EQ(column[5], 0.0f) << "nothing is below a limit of zero";
    EXPECT_FALSE(column.is_complete(0));

    // Vertex 5 is to be known until it exceeds a third of its theta; a third of the frames may be left out.
    limits[5] = static_cast<float>(theta(5) / 3.0);
    column.extend(0, limits.data());
    EXPECT_FALSE(column.is_complete(0));
    EXPECT_GE(column[5], limits[5]);
    EXPECT_LT(column[5], static_cast<float>(theta(5)));

    limits[7] = 1e30f;
    column.extend(0, limits.data());
    EXPECT_TRUE(column.is_complete(0));
    EXPECT_FALSE(column.is_complete(1));
    for (std::int64_t v = 0; v < kVertexBlock; ++v)
        EXPECT_NEAR(column[static_cast<std::size_t>(v)], theta(v), 1e-4 * theta(v));
}

}  // namespace
}  // namespace batchenc
