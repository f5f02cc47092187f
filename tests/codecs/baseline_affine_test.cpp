#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/codecs/baseline_support.h"

namespace batchenc {
namespace {

using test::encode, test::extent_of, test::rmse_of, test::step_of;

CodecParameters at(std::int32_t bits) { return {.method = CodecMethod::kBaselineAffine, .bits = bits}; }

std::size_t payload_size(std::span<const std::uint8_t> bytes, SectionId section) {
    return parse_clip_bitstream(bytes)->payload(section).size();
}

TEST(BaselineAffine, RoundTripsEveryKindOfClip) {
    for (const auto& [name, clip] : test::every_kind_of_clip()) {
        for (const std::int32_t bits : {4, 9, 14, 20}) {
            for (const std::int32_t clusters : {1, 4, 200}) {
                // The transform is orthonormal, and every coefficient within half a step; so is the root of
                // the mean square of each coordinate. The first frame is within a step.
                EXPECT_LE(rmse_of(clip, encode(clip, at(bits), clusters)),
                          step_of(clip, bits) + 8e-7 * extent_of(clip))
                    << name << ", " << bits << " bits, " << clusters << " clusters";
            }
        }
    }
}

TEST(BaselineAffine, AnAffineMotionHasHardlyResiduals) {
    const auto affine = [](const std::array<double, 3>& p, double time) {
        const double c = std::cos(2.0 * time), s = std::sin(2.0 * time);
        return std::array<double, 3>{c * p[0] - s * p[1] + 0.3 * time * p[2] + 2.0 * time,
                                     s * p[0] + c * p[1], (1.0 + 0.5 * time) * p[2] - 0.1 * time * p[0]};
    };
    const MeshSequence clip = test::sheet(20, 20, 60, affine);
    const auto bytes = encode(clip, at(10), 1);
    const double samples = 400.0 * 59.0;
    EXPECT_LT(8.0 * static_cast<double>(payload_size(bytes, SectionId::kResiduals)), 0.1 * samples);
    EXPECT_LT(payload_size(bytes, SectionId::kCoefficients), 1000u);
    // Where it bends, residuals are what costs.
    const auto bent = encode(test::sheet(20, 20, 60), at(10), 1);
    EXPECT_GT(payload_size(bent, SectionId::kResiduals), 5 * payload_size(bytes, SectionId::kResiduals));
}

TEST(BaselineAffine, WeightsCarryWhatBlendsTwoMotions) {
    // The left third stands, the right third turns, what is between follows both by parts.
    const auto skinned = [](const std::array<double, 3>& p, double time) {
        const double w = std::clamp(3.0 * p[0] - 1.0, 0.0, 1.0);
        const double c = std::cos(2.0 * time), s = std::sin(2.0 * time);
        return std::array<double, 3>{p[0] + w * (c * (p[0] - 1.0) - s * p[1] - p[0] + 1.0),
                                     p[1] + w * (s * (p[0] - 1.0) + c * p[1] - p[1]), p[2]};
    };
    const MeshSequence clip = test::sheet(30, 20, 60, skinned);
    MeshSequence points = clip;
    points.triangles.clear();  // no clusters are joined
    const auto blended = encode(clip, at(12), 3), hard = encode(points, at(12), 3);
    EXPECT_GT(payload_size(blended, SectionId::kBasis), 0u);
    EXPECT_EQ(payload_size(hard, SectionId::kBasis), 0u);
    EXPECT_LT(2 * payload_size(blended, SectionId::kResiduals), payload_size(hard, SectionId::kResiduals));
}

TEST(BaselineAffine, MoreBitsCostMoreAndHelp) {
    test::expect_bits_help(test::walker(600, 80), at(6), 12);  // two blocks
}

TEST(BaselineAffine, SaysWhatItWasCodedWith) {
    const MeshSequence clip = test::sheet(9, 8, 5);
    const auto bytes = encode(clip, at(11), 4);
    const auto info = read_clip_info(bytes);
    ASSERT_TRUE(info);
    EXPECT_EQ(info->method, CodecMethod::kBaselineAffine);
    EXPECT_EQ(info->parameters.bits, 11);
    EXPECT_EQ(info->cluster_count, 4);
    const auto decoded = decode_clip(bytes, clip.triangles, -1, test::kLimit, SerialExecutor());
    ASSERT_TRUE(decoded);
    EXPECT_EQ((*decoded)->labels().size(), 72u);
}

TEST(BaselineAffine, SameBytesForAnyExecutor) {
    test::expect_same_for_any_executor(test::sheet(13, 9, 25), at(11), 5);
}

TEST(BaselineAffine, DecodesAnyRangeOfFrames) {
    const MeshSequence clip = test::sheet(9, 8, 37);
    test::expect_any_range_decodes(encode(clip, at(10), 3), clip);
}

// ---- hostile bytes ----

TEST(BaselineAffine, RejectsEveryTruncationAndFlippedBitAndExtraByte) {
    const MeshSequence clip = test::sheet(4, 3, 4);
    test::expect_damage_is_refused(encode(clip, at(7), 2), clip);
}

TEST(BaselineAffine, SurvivesChangesBehindValidChecksums) {
    test::expect_changes_are_survived(test::sheet(6, 5, 7), at(9), 3);
}

TEST(BaselineAffine, RefusesCountsAndMemoryBeforeAllocating) {
    const MeshSequence clip = test::sheet(6, 5, 9);
    test::expect_counts_and_memory_are_refused(encode(clip, at(8), 3), clip);
}

TEST(BaselineAffine, RefusesMotionOfASingleFrame) {
    test::expect_motion_of_a_single_frame_is_refused(at(8), 2);
}

}  // namespace
}  // namespace batchenc
