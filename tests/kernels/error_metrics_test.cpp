#include "kernels/error_metrics.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <thread>
#include <vector>

namespace batchenc {
namespace {

struct Clip {
    std::int64_t frame_count, vertex_count;
    std::vector<float> source, decoded;

    PositionsView source_view() const { return {source.data(), frame_count, vertex_count}; }
    PositionsView decoded_view() const { return {decoded.data(), frame_count, vertex_count}; }
};

// A cloud that jitters while it walks away, and a copy with noise.
Clip walking_cloud(std::int64_t frame_count, std::int64_t vertex_count, float step, std::uint32_t seed) {
    std::mt19937 generator(seed);
    std::normal_distribution<float> normal;
    std::vector<float> rest(static_cast<std::size_t>(3 * vertex_count));
    for (float& x : rest) x = normal(generator);
    Clip clip{frame_count, vertex_count, {}, {}};
    for (std::int64_t f = 0; f < frame_count; ++f) {
        for (std::size_t i = 0; i < rest.size(); ++i) {
            clip.source.push_back(rest[i] + 100.0f + static_cast<float>(f) * step +
                                  0.05f * normal(generator));
            clip.decoded.push_back(clip.source.back() + 0.01f * normal(generator));
        }
    }
    return clip;
}

// The definitions read off the page, in two passes and double precision.
ErrorMetrics by_definition(const Clip& clip) {
    const auto F = clip.frame_count, V = clip.vertex_count;
    const auto at = [V](const std::vector<float>& data, std::int64_t f, std::int64_t v, std::int64_t axis) {
        return static_cast<double>(data[static_cast<std::size_t>((f * V + v) * 3 + axis)]);
    };
    ErrorMetrics m;
    double error = 0.0, about_time = 0.0, about_frame = 0.0, diagonal = 0.0;
    for (std::int64_t f = 0; f < F; ++f) {
        double frame_error = 0.0, frame_max = 0.0;
        for (std::int64_t v = 0; v < V; ++v) {
            double squared = 0.0;
            for (std::int64_t axis = 0; axis < 3; ++axis) {
                squared += std::pow(at(clip.source, f, v, axis) - at(clip.decoded, f, v, axis), 2);
            }
            frame_error += squared;
            frame_max = std::max(frame_max, squared);
        }
        error += frame_error;
        m.frame_rmse.push_back(std::sqrt(frame_error / static_cast<double>(V)));
        m.frame_max_error.push_back(std::sqrt(frame_max));
        double squared_jump = 0.0;
        for (std::int64_t v = 0; f > 0 && v < V; ++v) {
            for (std::int64_t axis = 0; axis < 3; ++axis) {
                const auto wrong = [&](std::int64_t frame) {
                    return at(clip.source, frame, v, axis) - at(clip.decoded, frame, v, axis);
                };
                squared_jump += std::pow(wrong(f) - wrong(f - 1), 2);
            }
        }
        m.frame_jump.push_back(std::sqrt(squared_jump / static_cast<double>(V)));
    }
    for (std::int64_t axis = 0; axis < 3; ++axis) {
        double low = 1e300, high = -1e300;
        for (std::int64_t v = 0; v < V; ++v) {
            double mean = 0.0;
            for (std::int64_t f = 0; f < F; ++f) mean += at(clip.source, f, v, axis) / static_cast<double>(F);
            for (std::int64_t f = 0; f < F; ++f) {
                about_time += std::pow(at(clip.source, f, v, axis) - mean, 2);
                low = std::min(low, at(clip.source, f, v, axis));
                high = std::max(high, at(clip.source, f, v, axis));
            }
        }
        for (std::int64_t f = 0; f < F; ++f) {
            double mean = 0.0;
            for (std::int64_t v = 0; v < V; ++v) mean += at(clip.source, f, v, axis) / static_cast<double>(V);
            for (std::int64_t v = 0; v < V; ++v)
                about_frame += std::pow(at(clip.source, f, v, axis) - mean, 2);
        }
        diagonal += (high - low) * (high - low);
    }
    m.da = 100.0 * std::sqrt(error / about_time);
    m.kg = 100.0 * std::sqrt(error / about_frame);
    m.rmse = std::sqrt(error / static_cast<double>(F * V));
    m.max_error = *std::max_element(m.frame_max_error.begin(), m.frame_max_error.end());
    m.diagonal = std::sqrt(diagonal);
    m.max_error_relative = m.max_error / m.diagonal;
    return m;
}

ErrorMetrics measure(const Clip& clip, const Executor& executor = SerialExecutor()) {
    ErrorMeter meter(clip.vertex_count);
    meter.add(clip.source_view(), clip.decoded_view(), executor);
    return meter.finish();
}

void expect_near(const ErrorMetrics& measured, const ErrorMetrics& expected, double relative) {
    EXPECT_NEAR(measured.da, expected.da, relative * expected.da);
    EXPECT_NEAR(measured.kg, expected.kg, relative * expected.kg);
    EXPECT_NEAR(measured.kg * std::sqrt(measured.kg_spread), measured.da * std::sqrt(measured.da_spread),
                1e-12 * measured.da * std::sqrt(measured.da_spread));
    EXPECT_NEAR(measured.rmse, expected.rmse, relative * expected.rmse);
    EXPECT_NEAR(measured.max_error, expected.max_error, relative * expected.max_error);
    EXPECT_NEAR(measured.max_error_relative, expected.max_error_relative,
                relative * expected.max_error_relative);
    EXPECT_NEAR(measured.diagonal, expected.diagonal, relative * expected.diagonal);
    ASSERT_EQ(measured.frame_rmse.size(), expected.frame_rmse.size());
    ASSERT_EQ(measured.frame_max_error.size(), expected.frame_max_error.size());
    ASSERT_EQ(measured.frame_jump.size(), expected.frame_jump.size());
    for (std::size_t f = 0; f < expected.frame_rmse.size(); ++f) {
        EXPECT_NEAR(measured.frame_rmse[f], expected.frame_rmse[f], relative * expected.frame_rmse[f]);
        EXPECT_NEAR(measured.frame_max_error[f], expected.frame_max_error[f],
                    relative * expected.frame_max_error[f]);
        EXPECT_NEAR(measured.frame_jump[f], expected.frame_jump[f], relative * expected.frame_jump[f]);
    }
}

void expect_same_bits(const ErrorMetrics& a, const ErrorMetrics& b) {
    EXPECT_EQ(a.da, b.da);
    EXPECT_EQ(a.kg, b.kg);
    EXPECT_EQ(a.rmse, b.rmse);
    EXPECT_EQ(a.max_error, b.max_error);
    EXPECT_EQ(a.max_error_relative, b.max_error_relative);
    EXPECT_EQ(a.diagonal, b.diagonal);
    EXPECT_EQ(a.frame_rmse, b.frame_rmse);
    EXPECT_EQ(a.frame_max_error, b.frame_max_error);
    EXPECT_EQ(a.frame_jump, b.frame_jump);
}

// Hands the indices to two threads, so that a data race would show under the thread sanitizer.
class TwoThreadExecutor final : public Executor {
 public:
    void for_each(std::int64_t count, const std::function<void(std::int64_t)>& function) const override {
        const auto every_other = [&](std::int64_t first) {
            for (std::int64_t i = first; i < count; i += 2) function(i);
        };
        std::thread other(every_other, 1);
        every_other(0);
        other.join();
    }
};

TEST(ErrorMeter, GivesTheHandWorkedNumbers) {
    // Two vertices, two frames. Vertex 0 stays at the origin; vertex 1 goes from (2,0,0) to (4,0,0).
    // Errors: (0,3,4) at vertex 1 in frame 1, nothing else. Squared error 25.
    // About the means over time (0,0,0) and (3,0,0): 0 + 0 + 1 + 1 = 2.
    // About the frames' means (1,0,0) and (2,0,0): 1 + 1 + 4 + 4 = 10. Bounding box 4 x 0 x 0.
    const Clip clip{2, 2, {0, 0, 0, 2, 0, 0, 0, 0, 0, 4, 0, 0}, {0, 0, 0, 2, 0, 0, 0, 0, 0, 4, 3, 4}};
    const ErrorMetrics m = measure(clip);
    EXPECT_DOUBLE_EQ(m.da, 100.0 * std::sqrt(12.5));
    EXPECT_DOUBLE_EQ(m.kg, 100.0 * std::sqrt(2.5));
    EXPECT_DOUBLE_EQ(m.rmse, 2.5);
    EXPECT_DOUBLE_EQ(m.max_error, 5.0);
    EXPECT_DOUBLE_EQ(m.diagonal, 4.0);
    EXPECT_DOUBLE_EQ(m.max_error_relative, 1.25);
    EXPECT_EQ(m.frame_rmse, (std::vector<double>{0.0, std::sqrt(12.5)}));
    EXPECT_EQ(m.frame_max_error, (std::vector<double>{0.0, 5.0}));
    EXPECT_EQ(m.frame_jump, (std::vector<double>{0.0, std::sqrt(12.5)}));
}

TEST(ErrorMeter, AnErrorThatStaysDoesNotJump) {
    // Off by (1,2,2) in every frame, so each frame is as wrong as the other and none jumps; then by nothing.
    const Clip clip{4, 1, {0, 0, 0, 5, 0, 0, 9, 9, 9, 1, 1, 1}, {1, 2, 2, 6, 2, 2, 10, 11, 11, 1, 1, 1}};
    EXPECT_EQ(measure(clip).frame_jump, (std::vector<double>{0.0, 0.0, 0.0, 3.0}));
}

TEST(ErrorMeter, FindsTheLargestErrorAtEveryVertexAndAxis) {
    for (const std::int64_t V : {1, 2, 3, 4, 5, 7, 8, 2047, 2048, 2049, 2051}) {
        for (std::int64_t v = 0; v < V; v += V < 10 ? 1 : 101) {
            for (std::int64_t axis = 0; axis < 3; ++axis) {
                Clip clip = walking_cloud(2, V, 0.5f, 11);
                clip.decoded = clip.source;
                clip.decoded[static_cast<std::size_t>((V + v) * 3 + axis)] += 1000.0f;
                const ErrorMetrics m = measure(clip);
                ASSERT_NEAR(m.max_error, 1000.0, 1e-3) << V << " " << v << " " << axis;
                ASSERT_EQ(m.frame_max_error[0], 0.0);
                ASSERT_NEAR(m.frame_rmse[1], 1000.0 / std::sqrt(static_cast<double>(V)), 1e-3);
            }
        }
    }
}

TEST(ErrorMeter, AgreesWithTheDefinitionsForEverySizeOfTheLastBlock) {
    for (const std::int64_t V :
         {2, 3, 4, 5, 6, 7, 8, 9, 100, 1023, 2047, 2048, 2049, 2050, 4095, 4096, 5000}) {
        SCOPED_TRACE(V);
        const Clip clip = walking_cloud(7, V, 0.3f, static_cast<std::uint32_t>(V));
        expect_near(measure(clip), by_definition(clip), 1e-11);
    }
}

TEST(ErrorMeter, KeepsItsDigitsWhereTheWalkDominates) {
    // Travels 2000 times its own motion; then stands 10^5 times its size away from the world's origin.
    for (const float step : {5.0f, 0.0f}) {
        Clip clip = walking_cloud(400, 50, step, 5);
        if (step == 0.0f) {
            for (std::vector<float>* data : {&clip.source, &clip.decoded}) {
                for (float& x : *data) x += 1e5f;
            }
        }
        expect_near(measure(clip), by_definition(clip), 1e-10);
    }
}

TEST(ErrorMeter, RunsOfFramesGiveWhatTheWholeGives) {
    const Clip clip = walking_cloud(10, 1500, 0.5f, 6);
    ErrorMeter meter(clip.vertex_count);
    for (const auto& [begin, end] : {std::pair{0, 3}, {3, 4}, {4, 4}, {4, 10}}) {
        meter.add(clip.source_view().frames(begin, end), clip.decoded_view().frames(begin, end),
                  SerialExecutor());
    }
    expect_near(meter.finish(), by_definition(clip), 1e-11);
    EXPECT_EQ(meter.finish().frame_jump, measure(clip).frame_jump);  // bit for bit, runs or not
}

TEST(ErrorMeter, DoesNotDependOnTheExecutor) {
    const Clip clip = walking_cloud(5, 9000, 0.5f, 7);
    const ErrorMetrics expected = measure(clip);
    for (std::uint64_t seed = 1; seed <= 10; ++seed)
        expect_same_bits(measure(clip, ShuffledExecutor(seed)), expected);
    expect_same_bits(measure(clip, TwoThreadExecutor()), expected);
}

TEST(ErrorMeter, QuotientsOfNothingAreZeroAndQuotientsByNothingAreNaN) {
    const Clip still_and_exact{2, 1, {1, 2, 3, 1, 2, 3}, {1, 2, 3, 1, 2, 3}};
    ErrorMetrics m = measure(still_and_exact);
    EXPECT_EQ(m.da, 0.0);
    EXPECT_EQ(m.kg, 0.0);
    EXPECT_EQ(m.max_error_relative, 0.0);
    EXPECT_EQ(m.diagonal, 0.0);

    const Clip still_and_wrong{2, 1, {1, 2, 3, 1, 2, 3}, {1, 2, 3, 1, 2, 4}};
    m = measure(still_and_wrong);
    EXPECT_TRUE(std::isnan(m.da));
    EXPECT_TRUE(std::isnan(m.kg));
    EXPECT_TRUE(std::isnan(m.max_error_relative));
    EXPECT_EQ(m.max_error, 1.0);
    EXPECT_EQ(m.rmse, std::sqrt(0.5));
}

TEST(ErrorMeter, OneFrameHasNoSpreadOverTime) {
    const Clip clip = walking_cloud(1, 10, 0.5f, 8);
    const ErrorMetrics m = measure(clip);
    EXPECT_TRUE(std::isnan(m.da));
    EXPECT_NEAR(m.kg, by_definition(clip).kg, 1e-11 * m.kg);
}

TEST(ErrorMeter, NoFramesAndNoVerticesGiveZeros) {
    EXPECT_EQ(ErrorMeter(3).finish().rmse, 0.0);
    ErrorMeter meter(0);
    meter.add({nullptr, 2, 0}, {nullptr, 2, 0}, SerialExecutor());
    EXPECT_EQ(meter.finish().kg, 0.0);
    EXPECT_EQ(meter.finish().frame_rmse.size(), 2u);
    EXPECT_EQ(meter.finish().frame_jump.size(), 2u);
}

}  // namespace
}  // namespace batchenc
