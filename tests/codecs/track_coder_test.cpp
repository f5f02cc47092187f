#include "codecs/track_coder.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "tests/support/thread_executor.h"

namespace batchenc {
namespace {

constexpr std::int64_t kFrameCounts[] = {1, 2, 3, 7, 8, 11, 12, 13, 40, 100, 383, 384, 700};

TEST(TrackBlocks, CoverTheFramesInNearlyEqualParts) {
    for (const std::int64_t frames : kFrameCounts) {
        for (std::size_t form = 0; form < kTrackForms; ++form) {
            const TrackBlocks blocks(frames, static_cast<TrackForm>(form));
            EXPECT_EQ(blocks.begin(0), 0);
            EXPECT_EQ(blocks.begin(blocks.count), frames);
            for (std::int64_t b = 0; b < blocks.count; ++b) {
                const std::int64_t length = blocks.begin(b + 1) - blocks.begin(b);
                EXPECT_GE(length, frames / blocks.count);
                EXPECT_LE(length, (frames + blocks.count - 1) / blocks.count);
                EXPECT_GE(length, 1);
            }
            if (form >= 2) {
                EXPECT_LE(frames / blocks.count, (8 << (form - 2)) * 3 / 2);
            }
        }
    }
    EXPECT_EQ(TrackBlocks(12, TrackForm::kBlocks8).count, 2);
    EXPECT_EQ(TrackBlocks(11, TrackForm::kBlocks8).count, 1);
    EXPECT_EQ(TrackBlocks(700, TrackForm::kBlocks256).count, 3);
}

void expect_round_trip(std::int64_t frames, const std::vector<TrackLevels>& tracks) {
    BitCoder coder;
    TrackCoder written(frames);
    for (std::size_t t = 0; t < tracks.size(); ++t) {
        TrackLevels copy = tracks[t];
        written.code(coder, copy, t);
        EXPECT_EQ(copy.values, tracks[t].values) << "track " << t;
    }
    const auto bytes = coder.finish();
    BitCoder decoder(bytes);
    TrackCoder read(frames);
    for (std::size_t t = 0; t < tracks.size(); ++t) {
        TrackLevels track;
        track.form = TrackForm::kSlopes;
        track.values.assign(static_cast<std::size_t>(3 * frames), 77);
        read.code(decoder, track, t);
        EXPECT_EQ(track.form, tracks[t].form);
        EXPECT_EQ(track.values, tracks[t].values) << frames << " frames, track " << t;
    }
    EXPECT_FALSE(decoder.is_overrun());
    EXPECT_TRUE(decoder.check_end());
}

TEST(TrackCoder, RoundTripsLevelsOfEveryForm) {
    std::mt19937 random(1);
    for (const std::int64_t frames : kFrameCounts) {
        std::vector<TrackLevels> tracks;
        for (std::size_t t = 0; t < 3 * kTrackForms; ++t) {
            TrackLevels track;
            track.form = static_cast<TrackForm>(t % kTrackForms);
            const std::int32_t largest = t < kTrackForms ? 2 : t < 2 * kTrackForms ? 3000 : 1 << 24;
            for (std::int64_t k = 0; k < 3 * frames; ++k)
                track.values.push_back(
                    static_cast<std::int32_t>(random() % (2u * static_cast<unsigned>(largest) + 1)) -
                    largest);
            tracks.push_back(track);
        }
        expect_round_trip(frames, tracks);
    }
}

// Any bytes give levels; nothing is read or written outside, and the end is found.
TEST(TrackCoder, TakesAnyBytes) {
    std::mt19937 random(2);
    for (const std::int64_t frames : {1, 5, 64, 300}) {
        for (int round = 0; round < 30; ++round) {
            std::vector<std::uint8_t> bytes(static_cast<std::size_t>(random() % 200));
            for (auto& b : bytes)
                b = round % 3 == 0 ? std::uint8_t{0xff} : static_cast<std::uint8_t>(random());
            BitCoder coder(bytes);
            TrackCoder tracks(frames);
            const TrackTransform transform(frames);
            for (std::size_t t = 0; t < 40 && !coder.is_overrun(); ++t) {
                std::vector<TrackLevels> track(1);
                track[0].values.resize(static_cast<std::size_t>(3 * frames));
                tracks.code(coder, track[0], t);
                EXPECT_EQ(transform.dequantize(track, SerialExecutor())[0].size(), track[0].values.size());
            }
        }
    }
}

/// A track of 3F values from a function of axis and frame.
template <typename Function>
std::vector<float> make_track(std::int64_t frames, Function function) {
    std::vector<float> track;
    for (std::int64_t f = 0; f < frames; ++f) {
        for (int axis = 0; axis < 3; ++axis)
            track.push_back(static_cast<float>(function(axis, static_cast<double>(f))));
    }
    return track;
}

double rms_difference(const std::vector<float>& a, const std::vector<float>& b) {
    double sum = 0.0;
    for (std::size_t k = 0; k < a.size(); ++k)
        sum += (static_cast<double>(a[k]) - b[k]) * (static_cast<double>(a[k]) - b[k]);
    return std::sqrt(sum / static_cast<double>(a.size()));
}

TEST(TrackTransform, KeepsWithinAboutAStep) {
    std::mt19937 random(3);
    std::normal_distribution<double> normal;
    for (const std::int64_t frames : kFrameCounts) {
        const TrackTransform transform(frames);
        std::vector<std::vector<float>> tracks;
        for (const double size : {0.0, 0.3, 4.0, 5000.0, 1e6}) {
            tracks.push_back(make_track(frames, [&](int, double) { return size * normal(random); }));
            tracks.push_back(
                make_track(frames, [&](int axis, double f) { return size * std::sin(0.05 * f + axis); }));
            tracks.push_back(
                make_track(frames, [&](int axis, double f) { return size * (axis + 0.01 * f); }));
        }
        const auto levels = transform.quantize(tracks, SerialExecutor());
        const auto back = transform.dequantize(levels, SerialExecutor());
        ASSERT_EQ(levels.size(), tracks.size());
        for (std::size_t t = 0; t < tracks.size(); ++t) {
            const double rounding =
                1e-6 * std::sqrt(static_cast<double>(frames)) *
                static_cast<double>(*std::max_element(tracks[t].begin(), tracks[t].end()));
            EXPECT_LE(rms_difference(tracks[t], back[t]), 0.75 + std::abs(rounding))
                << frames << ", track " << t;
        }
        expect_round_trip(frames, levels);
    }
}

TEST(TrackTransform, ChoosesTheFormThatSuits) {
    constexpr std::int64_t kFrames = 600;
    std::mt19937 random(4);
    const TrackTransform transform(kFrames);
    std::vector<float> jumps;  // stands still, and then is a little elsewhere
    std::array<double, 3> at{};
    for (std::int64_t f = 0; f < kFrames; ++f) {
        for (double& x : at) {
            if (random() % 40 == 0) x += random() % 2 == 0 ? 4.0 : -4.0;
            jumps.push_back(static_cast<float>(x));
        }
    }
    const auto wave = [](int axis, double f) {  // one frequency of two blocks of 300 frames
        return 5000.0 * std::cos(std::numbers::pi / 300.0 * (12.0 + axis) * (f + 0.5));
    };
    const std::vector<std::vector<float>> tracks = {
        jumps, make_track(kFrames, [](int axis, double f) { return 37.0 * f * (axis + 1); }),
        make_track(kFrames, wave)};
    const auto levels = transform.quantize(tracks, SerialExecutor());
    EXPECT_EQ(levels[0].form, TrackForm::kSteps);
    EXPECT_EQ(levels[1].form, TrackForm::kSlopes);
    EXPECT_GE(levels[2].form, TrackForm::kBlocks64);
}

// What transformed would not fit into 32 bits goes value by value.
TEST(TrackTransform, TakesTheLargestValues) {
    constexpr std::int64_t kFrames = 300;
    const std::vector<std::vector<float>> tracks = {
        make_track(kFrames, [](int, double) { return 0x1p27; }),
        make_track(kFrames, [](int, double f) { return f < 150 ? -0x1p27 : 0x1p27; }),
        make_track(kFrames, [](int, double f) { return static_cast<int>(f) % 2 == 0 ? -0x1p27 : 0x1p27; })};
    const TrackTransform transform(kFrames);
    const auto levels = transform.quantize(tracks, SerialExecutor());
    const auto back = transform.dequantize(levels, SerialExecutor());
    for (std::size_t t = 0; t < tracks.size(); ++t) {
        for (std::size_t k = 0; k < tracks[t].size(); ++k) EXPECT_NEAR(back[t][k], tracks[t][k], 1.5f);
    }
    expect_round_trip(kFrames, levels);
}

TEST(TrackTransform, SameLevelsForAnyExecutor) {
    std::vector<std::vector<float>> tracks;
    for (int t = 0; t < 23; ++t)
        tracks.push_back(
            make_track(90, [&](int axis, double f) { return 50.0 * std::sin(0.3 * f * axis + t); }));
    const TrackTransform transform(90);
    const auto expected = transform.quantize(tracks, SerialExecutor());
    const test::ThreadExecutor threads(3);
    const auto levels = transform.quantize(tracks, threads);
    for (std::size_t t = 0; t < tracks.size(); ++t) {
        EXPECT_EQ(levels[t].form, expected[t].form);
        EXPECT_EQ(levels[t].values, expected[t].values);
    }
    EXPECT_EQ(transform.dequantize(levels, threads), transform.dequantize(levels, SerialExecutor()));
}

}  // namespace
}  // namespace batchenc
