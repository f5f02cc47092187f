#include "kernels/local_frame.h"

#include <gtest/gtest.h>

namespace batchenc {
namespace {

TEST(LocalFrame, HandWorkedTriangle) {
    // Edge p1 p2 along world y, third point towards -x: x axis = +y, y axis = -x, z = x cross y = +z.
    const LocalFrame lcf = local_frame({2, 1, 5}, {2, 5, 5}, {-1, 2, 5}, {});
    EXPECT_EQ(lcf.origin, (std::array<double, 3>{2, 3, 5}));
    EXPECT_EQ(lcf.rotation, (std::array<double, 9>{0, 1, 0, -1, 0, 0, 0, 0, 1}));
}

TEST(LocalFrame, RotationIsOrthonormalAndThirdPointHasPositiveY) {
    const std::array<double, 3> p1 = {0.3, -1.2, 4.0}, p2 = {1.7, 0.4, 3.1}, p3 = {-0.2, 0.9, 5.5};
    const LocalFrame lcf = local_frame(p1, p2, p3, {});
    const auto& t = lcf.rotation;
    for (std::size_t a = 0; a < 3; ++a) {
        for (std::size_t b = 0; b < 3; ++b) {
            const double dot =
                t[3 * a] * t[3 * b] + t[3 * a + 1] * t[3 * b + 1] + t[3 * a + 2] * t[3 * b + 2];
            EXPECT_NEAR(dot, a == b ? 1.0 : 0.0, 1e-15);
        }
    }
    const auto local = [&](const std::array<double, 3>& p, std::size_t axis) {
        double sum = 0.0;
        for (std::size_t c = 0; c < 3; ++c) sum += t[3 * axis + c] * (p[c] - lcf.origin[c]);
        return sum;
    };
    EXPECT_NEAR(local(p2, 1), 0.0, 1e-15);
    EXPECT_GT(local(p3, 1), 0.0);
    EXPECT_NEAR(local(p3, 2), 0.0, 1e-15);
}

TEST(LocalFrame, TriangleWithoutAreaKeepsThePreviousRotation) {
    LocalFrame previous;
    previous.rotation = {0, 1, 0, -1, 0, 0, 0, 0, 1};
    for (const auto& p3 : {std::array<double, 3>{4, 0, 0}, std::array<double, 3>{0, 0, 0}}) {
        const LocalFrame lcf = local_frame({0, 0, 0}, {2, 0, 0}, p3, previous);
        EXPECT_EQ(lcf.rotation, previous.rotation);
        EXPECT_EQ(lcf.origin, (std::array<double, 3>{1, 0, 0}));
    }
    EXPECT_EQ(local_frame({1, 1, 1}, {1, 1, 1}, {1, 1, 1}, previous).rotation, previous.rotation);
}

TEST(LocalFrameTrack, IsPaddedStructureOfArrays) {
    LocalFrameTrack track(5);
    EXPECT_EQ(track.stride, 16);
    LocalFrame lcf;
    lcf.rotation = {1, 2, 3, 4, 5, 6, 7, 8, 9};
    lcf.origin = {10, 11, 12};
    track.set(4, lcf);
    for (int k = 0; k < 12; ++k) EXPECT_EQ(track.row(k)[4], static_cast<float>(k + 1));
    EXPECT_EQ(track.row(0)[5], 0.0f);
}

}  // namespace
}  // namespace batchenc
