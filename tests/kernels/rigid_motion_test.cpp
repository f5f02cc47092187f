#include "kernels/rigid_motion.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <numeric>

#include "kernels/variation.h"
#include "tests/support/sample_clips.h"

namespace batchenc {
namespace {

std::vector<std::int32_t> all_vertices(const MeshSequence& clip) {
    std::vector<std::int32_t> members(static_cast<std::size_t>(clip.vertex_count));
    std::iota(members.begin(), members.end(), 0);
    return members;
}

std::vector<float> first_frame(const MeshSequence& clip) {
    return {clip.positions.begin(), clip.positions.begin() + 3 * clip.vertex_count};
}

/// Variation of all vertices in the frames of a track.
double total_variation(const MeshSequence& clip, const LocalFrameTrack& track) {
    const VertexBlocks blocks(clip.view(), SerialExecutor());
    std::vector<float> rows(kVariationRows * kVertexBlock);
    double sum = 0.0;
    for (std::int64_t v = 0; v < clip.vertex_count; ++v) {
        variation_block(blocks.block(v / kVertexBlock), clip.frame_count, std::span(&track, 1), rows);
        sum += static_cast<double>(rows[static_cast<std::size_t>(v % kVertexBlock)]);
    }
    return sum;
}

void expect_rotations(const LocalFrameTrack& track) {
    for (std::int64_t f = 0; f < track.frame_count; ++f) {
        Eigen::Matrix3d t;
        for (int k = 0; k < 9; ++k) t(k / 3, k % 3) = static_cast<double>(track.row(k)[f]);
        EXPECT_NEAR((t * t.transpose() - Eigen::Matrix3d::Identity()).norm(), 0.0, 1e-5) << f;
        const double determinant = t.row(0).cross(t.row(1)).dot(t.row(2));
        EXPECT_NEAR(determinant, 1.0, 1e-5) << "frame " << f << " is mirrored";
    }
}

TEST(RigidMotion, BringsARigidBodyToRest) {
    const MeshSequence clip = test::sheet(8, 6, 30, [](const std::array<double, 3>& p, double time) {
        const double c = std::cos(5.0 * time), s = std::sin(5.0 * time);
        return std::array<double, 3>{900.0 + c * p[0] - s * p[2] + 3.0 * time, p[1] - time,
                                     s * p[0] + c * p[2]};
    });
    const LocalFrameTrack track = rigid_motion(clip.view(), all_vertices(clip), first_frame(clip));
    expect_rotations(track);
    // float32 at 900 has steps of 6e-5.
    EXPECT_LT(total_variation(clip, track), 48 * 30 * 1e-8);
    // T turns back what the body has turned: about y, by -5 time.
    const double time = 10.0 / 29.0;
    EXPECT_NEAR(track.row(0)[10], std::cos(5.0 * time), 1e-4);
    EXPECT_NEAR(track.row(2)[10], std::sin(5.0 * time), 1e-4);
}

TEST(RigidMotion, IsNoWorseThanOtherFrames) {
    const MeshSequence clip = test::sheet(8, 6, 30);
    std::vector<float> rest = first_frame(clip);
    const double best = total_variation(clip, rigid_motion(clip.view(), all_vertices(clip), rest));
    for (const Triangle& t : {Triangle{0, 7, 40}, {0, 1, 9}, {20, 21, 29}})
        EXPECT_LT(best, total_variation(clip, triangle_track(clip.view(), t)));
}

TEST(RigidMotion, KeepsAxesThatTheVerticesLeaveOpen) {
    // A plane, a line, one point and a point twice: never mirrored, never NaN, the line's frame does not
    // spin.
    for (const std::int64_t count : {1, 2, 5}) {
        const MeshSequence clip = test::sheet(count, 1, 20, [](const std::array<double, 3>& p, double time) {
            return std::array<double, 3>{p[0] + time, 2.0, 1.0};
        });
        const LocalFrameTrack track = rigid_motion(clip.view(), all_vertices(clip), first_frame(clip));
        expect_rotations(track);
        for (int k = 0; k < 9; ++k) EXPECT_NEAR(track.row(k)[19], track.row(k)[0], 1e-4) << count << " " << k;
    }
    const MeshSequence plane = test::sheet(5, 5, 20, [](const std::array<double, 3>& p, double time) {
        return std::array<double, 3>{std::cos(time) * p[0], p[1], std::sin(time) * p[0]};
    });
    const LocalFrameTrack track = rigid_motion(plane.view(), all_vertices(plane), first_frame(plane));
    expect_rotations(track);
    EXPECT_LT(total_variation(plane, track), 1e-8);
}

}  // namespace
}  // namespace batchenc
