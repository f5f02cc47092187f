#include <gtest/gtest.h>

#include <algorithm>

#include "codecs/baselines/wavelets.h"
#include "kernels/dct.h"
#include "tests/codecs/baseline_support.h"

namespace batchenc {
namespace {

using test::encode, test::extent_of, test::rmse_of, test::step_of;

CodecParameters at(std::int32_t bits) { return {.method = CodecMethod::kBaselineWavelet, .bits = bits}; }

/// One signal in all lanes, transformed.
std::vector<float> in_lanes(const std::vector<float>& signal) {
    std::vector<float> values;
    for (const float value : signal) values.insert(values.end(), kDctLanes, value);
    return values;
}
std::vector<float> first_lane(const std::vector<float>& values) {
    std::vector<float> signal;
    for (std::size_t k = 0; k < values.size(); k += kDctLanes) signal.push_back(values[k]);
    return signal;
}

TEST(LiftedWavelet, GivesWhatWasWorkedByHand) {
    // Nine samples, one level. An impulse of 16 at sample 4 is seen by the details at 3 and 5 as -9, at 1 and
    // 7 as +1, but the continuation at either end shows sample 4 to the detail at 1 once more (as sample -2
    // is 2, not 4: no). Even samples then take a quarter of the details beside them; those at the ends have
    // the same detail on both sides.
    const LiftedWavelet wavelet(9);
    EXPECT_EQ(wavelet.level_count(), 1);
    EXPECT_EQ(wavelet.low_count(), 5);
    EXPECT_EQ(wavelet.row_order(), (std::vector<std::int64_t>{0, 2, 4, 6, 8, 1, 3, 5, 7}));
    std::vector<float> values = in_lanes({0, 0, 0, 0, 16, 0, 0, 0, 0});
    wavelet.forward(values.data());
    EXPECT_EQ(first_lane(values), (std::vector<float>{0.5f, 1, -2, -9, 11.5f, -9, -2, 1, 0.5f}));
    wavelet.inverse(values.data());
    EXPECT_EQ(first_lane(values), (std::vector<float>{0, 0, 0, 0, 16, 0, 0, 0, 0}));
    // At the start: sample 0 is beside 1, and is seen by 3 at the far end; 1 sees 2 twice: -9 * 16 / 16 and,
    // as sample -2, +1.
    values = in_lanes({16, 0, 0, 0, 0, 0, 0, 0, 0});
    wavelet.forward(values.data());
    EXPECT_EQ(first_lane(values), (std::vector<float>{11.5f, -9, -2, 1, 0.25f, 0, 0, 0, 0}));
}

TEST(LiftedWavelet, IsInvertedExactlyOnWholeNumbersOfAnyLength) {
    for (const std::int64_t length : {1, 2, 3, 7, 8, 9, 10, 15, 16, 17, 31, 64, 100, 201}) {
        const LiftedWavelet wavelet(length);
        std::vector<float> signal;
        for (std::int64_t k = 0; k < length; ++k)
            signal.push_back(static_cast<float>(k * k * 7919 % 1013 - 500));
        std::vector<float> values = in_lanes(signal);
        wavelet.forward(values.data());
        wavelet.inverse(values.data());
        const std::vector<float> back = first_lane(values);
        // Every level takes six binary digits: two are exact in the 24 that float32 has.
        for (std::size_t k = 0; k < signal.size(); ++k)
            EXPECT_NEAR(back[k], signal[k], wavelet.level_count() <= 2 ? 0.0 : 1e-3) << length << ": " << k;
        std::vector<std::int64_t> rows = wavelet.row_order();
        std::sort(rows.begin(), rows.end());
        for (std::int64_t k = 0; k < length; ++k) EXPECT_EQ(rows[static_cast<std::size_t>(k)], k);
        EXPECT_LE(wavelet.low_count(), LiftedWavelet::kLowest);
        EXPECT_EQ(wavelet.gains().size(), static_cast<std::size_t>(wavelet.level_count() + 1));
    }
}

TEST(LiftedWavelet, HasNoDetailsOfACubicAwayFromTheEnds) {
    const LiftedWavelet wavelet(17);
    std::vector<float> signal;
    for (int k = 0; k < 17; ++k) signal.push_back(static_cast<float>(k * k * k - 20 * k * k + 3 * k));
    std::vector<float> values = in_lanes(signal);
    wavelet.forward(values.data());
    const std::vector<float> details = first_lane(values);
    for (const std::size_t k : {3u, 5u, 7u, 9u, 11u, 13u}) EXPECT_EQ(details[k], 0.0f) << k;
    EXPECT_NE(details[1], 0.0f);
}

TEST(BaselineWavelet, RoundTripsEveryKindOfClip) {
    for (const auto& [name, clip] : test::every_kind_of_clip()) {
        for (const std::int32_t bits : {4, 9, 14, 20}) {
            // Half a step where errors are spread evenly; a whole one has room for few samples and for ends,
            // where functions are longer than in the middle.
            EXPECT_LE(rmse_of(clip, encode(clip, at(bits))), step_of(clip, bits) + 4e-7 * extent_of(clip))
                << name << ", " << bits << " bits";
        }
    }
}

TEST(BaselineWavelet, MoreBitsCostMoreAndHelp) {
    const MeshSequence clip = test::walker(600, 60);
    // Errors of half a step in the root of the mean, whatever the band.
    EXPECT_NEAR(test::expect_bits_help(clip, at(6)) / step_of(clip, 15), 0.5, 0.05);
}

TEST(BaselineWavelet, LongRestCostsNextToNothing) {
    const auto still = [](const std::array<double, 3>& p, double) { return p; };
    const auto few = encode(test::sheet(8, 8, 8, still), at(12)),
               many = encode(test::sheet(8, 8, 128, still), at(12));
    EXPECT_LT(many.size(), 3 * few.size() / 2 + 64);
}

TEST(BaselineWavelet, SameBytesForAnyExecutor) {
    test::expect_same_for_any_executor(test::sheet(13, 9, 25), at(11));
}

TEST(BaselineWavelet, DecodesAnyRangeOfFrames) {
    const MeshSequence clip = test::sheet(9, 8, 37);
    test::expect_any_range_decodes(encode(clip, at(10)), clip);
}

// ---- hostile bytes ----

TEST(BaselineWavelet, RejectsEveryTruncationAndFlippedBitAndExtraByte) {
    const MeshSequence clip = test::sheet(4, 3, 10);
    test::expect_damage_is_refused(encode(clip, at(7)), clip);
}

TEST(BaselineWavelet, SurvivesChangesBehindValidChecksums) {
    test::expect_changes_are_survived(test::sheet(5, 4, 11), at(9));
}

TEST(BaselineWavelet, RefusesCountsAndMemoryBeforeAllocating) {
    const MeshSequence clip = test::sheet(6, 5, 9);
    test::expect_counts_and_memory_are_refused(encode(clip, at(8)), clip);
}

}  // namespace
}  // namespace batchenc
