#include <gtest/gtest.h>

#include <cmath>

#include "tests/codecs/baseline_support.h"

namespace batchenc {
namespace {

using test::decode, test::encode, test::largest_distance_of, test::rmse_of, test::side_of;

CodecParameters parameters_of(std::int32_t components, int bits) {
    return {.method = CodecMethod::kBaselineCoddyac, .bits = bits, .components = components};
}

std::int32_t component_count(std::span<const std::uint8_t> bytes) {
    return read_clip_info(bytes)->component_count;
}

TEST(BaselineTrajectories, RoundTripEveryKindOfClip) {
    for (const auto& [name, clip] : test::every_kind_of_clip()) {
        const double side = side_of(clip);
        const auto largest = static_cast<std::int32_t>(std::min(clip.vertex_count, 3 * clip.frame_count));
        for (const auto& [components, bits] : {std::pair<std::int32_t, int>{1, 12}, {3, 4}, {400, 14}}) {
            const auto bytes = encode(clip, parameters_of(components, bits));
            EXPECT_LE(component_count(bytes), std::min(components, largest)) << name;
            const MeshSequence decoded = decode(clip, bytes);
            for (const float value : decoded.positions) ASSERT_TRUE(std::isfinite(value)) << name;
            const double error = test::largest_distance(clip.view(), decoded.view());
            // All components there can be: what is left is rounding, also that of float32 far from the
            // origin.
            EXPECT_LE(error, (components >= 400 ? 2e-3 : 1.5) * side + (side > 0.0 ? 5e-3 : 1e-5)) << name;
        }
    }
}

TEST(BaselineTrajectories, ErrorFallsWithComponentsAndBits) {
    const MeshSequence clip = test::sheet(20, 20, 40);
    const double side = side_of(clip);
    double last = 1e9;
    for (const std::int32_t components : {1, 2, 4, 8, 16}) {
        const double error = rmse_of(clip, encode(clip, parameters_of(components, 14)));
        EXPECT_LT(error, last) << components;
        last = error;
    }
    EXPECT_LT(last, 1e-4 * side);
    last = 1e9;
    for (const int bits : {5, 7, 9, 11, 13}) {
        const double error = rmse_of(clip, encode(clip, parameters_of(30, bits)));
        EXPECT_LT(error, 0.5 * last) << bits;
        last = error;
        // A coefficient of L is half a step off at most, and its basis vector has unit norm; the basis and
        // the mean add about as much.
        const double step = std::ldexp(side, -bits);
        EXPECT_LT(error, step * std::sqrt(30.0 / 12.0 / 40.0) * 2.0 + 1e-5 * side) << bits;
    }
}

TEST(BaselineTrajectories, KeepNoComponentThatIsZero) {
    // All vertices move alike: the mean trajectory says it all but for the shape, which is three components,
    // constant in time.
    const MeshSequence clip = test::sheet(9, 9, 20, [](const std::array<double, 3>& p, double time) {
        return std::array<double, 3>{p[0] + std::sin(4.0 * time), p[1] - time, p[2]};
    });
    const auto bytes = encode(clip, parameters_of(40, 12));
    EXPECT_EQ(component_count(bytes), 3);
    const double side = side_of(clip);
    EXPECT_LT(largest_distance_of(clip, bytes), side / 4096.0);
    // Where there is no shape either, nothing is left.
    const MeshSequence point = test::sheet(4, 4, 20, [](const std::array<double, 3>&, double time) {
        return std::array<double, 3>{std::sin(4.0 * time), -time, 1.0};
    });
    EXPECT_EQ(component_count(encode(point, parameters_of(40, 12))), 0);
    // Coarser steps need fewer components.
    const MeshSequence bent = test::sheet(15, 15, 40);
    EXPECT_LT(component_count(encode(bent, parameters_of(40, 4))),
              component_count(encode(bent, parameters_of(40, 10))));
}

TEST(BaselineTrajectories, ClipOfRankFourNeedsFourComponents) {
    // Each vertex' trajectory is its place at rest along three constant trajectories, and a share of another.
    const MeshSequence clip = test::sheet(16, 14, 45, [](const std::array<double, 3>& p, double time) {
        const double share = std::sin(9.0 * p[1]) + p[0] * p[0];
        return std::array<double, 3>{p[0] + 0.1 * share * std::sin(5.0 * time), p[1] + 0.2 * share * time,
                                     p[2] - 0.1 * share * std::cos(8.0 * time)};
    });
    const double side = side_of(clip);
    const auto bytes = encode(clip, parameters_of(20, 13));
    EXPECT_EQ(component_count(bytes), 4);
    EXPECT_LT(rmse_of(clip, bytes), 1e-4 * side);
    EXPECT_GT(rmse_of(clip, encode(clip, parameters_of(3, 13))), 1e-3 * side);
}

TEST(BaselineTrajectories, PredictionOverTheMeshPays) {
    const MeshSequence clip = test::sheet(30, 30, 30);
    MeshSequence points = clip;
    points.triangles.clear();
    const CodecParameters parameters = parameters_of(10, 12);
    EXPECT_LT(static_cast<double>(encode(clip, parameters).size()),
              0.8 * static_cast<double>(encode(points, parameters).size()));
}

TEST(BaselineTrajectories, SameBytesForAnyExecutor) {
    test::expect_same_for_any_executor(test::sheet(25, 20, 22), parameters_of(8, 10));
}

TEST(BaselineTrajectories, DecodeAnyRangeOfFrames) {
    const MeshSequence clip = test::sheet(9, 8, 37);
    test::expect_any_range_decodes(encode(clip, parameters_of(5, 10)), clip);
}

TEST(BaselineTrajectories, DecodeTheFirstComponents) {
    const MeshSequence clip = test::sheet(16, 16, 40);
    test::expect_components_help(clip, encode(clip, parameters_of(12, 12)), {0, 1, 2, 4, 8, 12});
}

TEST(BaselineTrajectories, RefuseWhatCannotBeHeld) { test::expect_refused_or_close(parameters_of(36, 14)); }

TEST(BaselineTrajectories, RefuseDamage) {
    const MeshSequence clip = test::sheet(5, 4, 6);
    test::expect_damage_is_refused(encode(clip, parameters_of(3, 8)), clip);
}

TEST(BaselineTrajectories, SurviveChangesBehindValidChecksums) {
    const MeshSequence clip = test::sheet(6, 5, 9);
    test::expect_changes_are_survived(encode(clip, parameters_of(4, 8)), clip);
}

TEST(BaselineTrajectories, RefuseCountsAndMemory) {
    const MeshSequence clip = test::sheet(14, 14, 9);
    test::expect_counts_and_memory_are_refused(encode(clip, parameters_of(3, 8)), clip);
}

}  // namespace
}  // namespace batchenc
