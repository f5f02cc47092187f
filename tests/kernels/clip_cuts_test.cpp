#include "kernels/clip_cuts.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <random>

namespace batchenc {
namespace {

// A cloud on a sphere that swells in waves. Each act of `act_frames` frames has waves of its own, or all acts
// have the same where they are `alike`.
std::vector<float> acts(std::int64_t frame_count, std::int64_t vertex_count, std::int64_t act_frames,
                        bool alike) {
    constexpr std::size_t kWaves = 10;
    std::mt19937 generator(5);
    std::normal_distribution<double> normal;
    std::vector<std::array<double, 3>> rest(static_cast<std::size_t>(vertex_count));
    for (auto& p : rest) {
        for (double& x : p) x = normal(generator);
        const double length = std::hypot(p[0], p[1], p[2]);
        for (double& x : p) x /= length;
    }
    std::vector<std::vector<double>> patterns;  // of the act, a value a vertex
    std::vector<float> positions;
    for (std::int64_t f = 0; f < frame_count; ++f) {
        if (f == 0 || (!alike && f % act_frames == 0)) {
            patterns.assign(kWaves, std::vector<double>(rest.size()));
            for (auto& pattern : patterns)
                for (double& value : pattern) value = 0.02 * normal(generator);
        }
        for (std::size_t v = 0; v < rest.size(); ++v) {
            double swell = 1.0;
            for (std::size_t w = 0; w < kWaves; ++w)
                swell += patterns[w][v] *
                         std::sin((0.1 + 0.037 * static_cast<double>(w)) * static_cast<double>(f));
            for (const double x : rest[v]) positions.push_back(static_cast<float>(swell * x));
        }
    }
    return positions;
}

std::vector<std::int64_t> cut(const std::vector<float>& positions, std::int64_t vertex_count,
                              const ClipCutModel& model, std::int64_t run = 1000,
                              const Executor& executor = SerialExecutor()) {
    const PositionsView frames(
        positions.data(), static_cast<std::int64_t>(positions.size()) / (3 * vertex_count), vertex_count);
    ClipCutter cutter(vertex_count, model);
    for (std::int64_t f = 0; f < frames.frame_count(); f += run)
        cutter.add(frames.frames(f, std::min(f + run, frames.frame_count())), executor);
    return cutter.finish(executor);
}

TEST(ClipCuts, FallWhereTheMotionChanges) {
    const auto positions = acts(900, 300, 300, false);
    const auto clips = cut(positions, 300, {});
    ASSERT_EQ(clips.size(), 3U);
    EXPECT_NEAR(static_cast<double>(clips[0]), 300.0, 16.0);
    EXPECT_NEAR(static_cast<double>(clips[0] + clips[1]), 600.0, 16.0);
    EXPECT_EQ(clips[0] + clips[1] + clips[2], 900);
}

TEST(ClipCuts, LeaveOneMotionWhole) {
    EXPECT_EQ(cut(acts(900, 300, 300, true), 300, {}), std::vector<std::int64_t>{900});
}

TEST(ClipCuts, CostWhatManyVerticesPayAgain) {
    // The same samples stand for a hundred times as many vertices, each of which every new clip pays again.
    const auto few = acts(600, 200, 300, false);
    EXPECT_EQ(cut(few, 200, {}).size(), 2U);
    ClipCutModel expensive;
    expensive.vertex_bits = 1e6;
    EXPECT_EQ(cut(few, 200, expensive).size(), 1U);
}

TEST(ClipCuts, DependNeitherOnRunsNorOnTheExecutor) {
    const auto positions = acts(750, 100, 250, false);
    const auto expected = cut(positions, 100, {});
    EXPECT_GT(expected.size(), 1U);
    for (const std::int64_t run : {1, 7, 16, 499}) EXPECT_EQ(cut(positions, 100, {}, run), expected) << run;
    for (std::uint64_t seed = 0; seed < 5; ++seed)
        EXPECT_EQ(cut(positions, 100, {}, 50, ShuffledExecutor(seed)), expected) << seed;
}

TEST(ClipCuts, KeepToTheLengthsOfTheModel) {
    const auto positions = acts(407, 20, 100, false);
    for (const std::int64_t longest : {32, 33, 47, 80, 406, 407, 5000}) {
        ClipCutModel model;
        model.longest = longest;
        const auto clips = cut(positions, 20, model);
        EXPECT_EQ(std::accumulate(clips.begin(), clips.end(), std::int64_t{0}), 407) << longest;
        for (std::size_t i = 0; i < clips.size(); ++i) {
            EXPECT_LE(clips[i], longest);
            EXPECT_GE(clips[i], i + 1 < clips.size() ? 32 : 1) << longest;
        }
    }
}

TEST(ClipCuts, TakeWhatHardlyIsAClip) {
    EXPECT_TRUE(cut({}, 3, {}).empty());
    EXPECT_EQ(cut({1, 2, 3}, 1, {}), std::vector<std::int64_t>{1});                          // one point
    EXPECT_EQ(cut(std::vector<float>(3 * 50, 2.0f), 1, {}), std::vector<std::int64_t>{50});  // that stays
    EXPECT_EQ(cut(std::vector<float>(3 * 40 * 90, 0.0f), 40, {}),
              std::vector<std::int64_t>{90});  // in one place
    ClipCutModel world;
    world.local = false;
    world.groups = 1;
    const auto clips = cut(acts(100, 5, 100, true), 5, world);
    EXPECT_EQ(std::accumulate(clips.begin(), clips.end(), std::int64_t{0}), 100);
}

// Distances that float32 does not hold are no numbers to the model: it still ends, with clips of allowed
// lengths that fill the sequence.
TEST(ClipCuts, TakeAnyFiniteCoordinates) {
    for (const float size : {3.4e38f, 1e20f, 1e-20f, 1e-45f}) {
        std::vector<float> positions;
        for (int i = 0; i < 3 * 30 * 100; ++i) positions.push_back(i * i % 7 < 3 ? size : -size);
        for (const bool local : {true, false}) {
            ClipCutModel model;
            model.local = local;
            model.longest = 48;
            const auto clips = cut(positions, 30, model);
            EXPECT_EQ(std::accumulate(clips.begin(), clips.end(), std::int64_t{0}), 100) << size;
            for (const std::int64_t clip : clips) EXPECT_LE(clip, 48) << size;
        }
    }
}

}  // namespace
}  // namespace batchenc
