#include "kernels/edge_distortion.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>
#include <set>
#include <vector>

namespace batchenc {
namespace {

using Point = std::array<float, 3>;

/// Frames of a mesh as the decoder left them, beside the source's.
struct Pair {
    std::int64_t vertex_count = 0;
    std::vector<Triangle> triangles;
    std::vector<float> source, decoded;

    std::int64_t frame_count() const { return static_cast<std::int64_t>(source.size()) / (3 * vertex_count); }
    PositionsView view(const std::vector<float>& positions) const {
        return {positions.data(), frame_count(), vertex_count};
    }
};

EdgeDistortion measure(const Pair& pair, const Executor& executor = SerialExecutor()) {
    EdgeDistortionMeter meter(pair.triangles, pair.vertex_count);
    meter.add(pair.view(pair.source), pair.view(pair.decoded), executor);
    return meter.finish();
}

std::vector<float> flat(const std::vector<Point>& points) {
    std::vector<float> values;
    for (const Point& p : points) values.insert(values.end(), p.begin(), p.end());
    return values;
}

/// One frame of the triangle (0, 0, 0), (3, 0, 0), (0, 4, 0).
Pair right_triangle() {
    Pair pair{3, {{0, 1, 2}}, flat({{0, 0, 0}, {3, 0, 0}, {0, 4, 0}}), {}};
    pair.decoded = pair.source;
    return pair;
}

/// A grid that waves, and a copy with noise.
Pair waving_grid(int side, int frames, float noise) {
    Pair pair{side * side, {}, {}, {}};
    for (int i = 0; i + 1 < side; ++i) {
        for (int j = 0; j + 1 < side; ++j) {
            const int v = i * side + j;
            pair.triangles.push_back({v, v + 1, v + side});
            pair.triangles.push_back({v + 1, v + side + 1, v + side});
        }
    }
    std::mt19937 generator(7);
    std::normal_distribution<float> normal;
    for (int f = 0; f < frames; ++f) {
        for (int v = 0; v < side * side; ++v) {
            const auto x = static_cast<float>(v / side), y = static_cast<float>(v % side);
            for (const float value : {x, y, std::sin(0.3f * x + 0.4f * static_cast<float>(f))}) {
                pair.source.push_back(value);
                pair.decoded.push_back(value + noise * normal(generator));
            }
        }
    }
    return pair;
}

// The definitions of the header, read off in plain loops.
EdgeDistortion by_definition(const Pair& pair) {
    const auto at = [&](const std::vector<float>& positions, std::int64_t f, std::int64_t v) {
        return positions.data() + 3 * (f * pair.vertex_count + v);
    };
    const auto length = [](const float* a, const float* b) {
        return std::hypot(double{a[0]} - double{b[0]}, double{a[1]} - double{b[1]},
                          double{a[2]} - double{b[2]});
    };
    std::vector<std::set<std::int64_t>> around(static_cast<std::size_t>(pair.vertex_count));
    for (const Triangle& t : pair.triangles) {
        for (const std::int32_t a : t) {
            for (const std::int32_t b : t) {
                if (a != b) around[static_cast<std::size_t>(a)].insert(b);
            }
        }
    }
    double low[3] = {1e30, 1e30, 1e30}, high[3] = {-1e30, -1e30, -1e30};
    for (std::int64_t v = 0; v < pair.vertex_count; ++v) {
        for (int axis = 0; axis < 3; ++axis) {
            low[axis] = std::min(low[axis], double{at(pair.source, 0, v)[axis]});
            high[axis] = std::max(high[axis], double{at(pair.source, 0, v)[axis]});
        }
    }
    const double tau = 0.001 * std::hypot(high[0] - low[0], high[1] - low[1], high[2] - low[2]);

    double space = 0.0, space_count = 0.0, time = 0.0, time_count = 0.0;
    for (std::int64_t f = 0; f < pair.frame_count(); ++f) {
        for (std::int64_t v = 0; v < pair.vertex_count; ++v) {
            const auto& near = around[static_cast<std::size_t>(v)];
            if (near.empty()) continue;
            std::vector<std::pair<double, double>> edges;  // l and d
            for (const std::int64_t w : near) {
                const double l = length(at(pair.source, f, v), at(pair.source, f, w));
                const double decoded = length(at(pair.decoded, f, v), at(pair.decoded, f, w));
                if (l > 0.0) edges.emplace_back(l, std::abs(decoded - l) / l);
            }
            double sum = 0.0, mean = 0.0, squares = 0.0;
            for (const auto& [l, d] : edges) sum += l;
            for (const auto& [l, d] : edges) mean += l * d / sum;
            for (const auto& [l, d] : edges) squares += l * (d - mean) * (d - mean) / sum;
            space += std::sqrt(squares);
            ++space_count;
        }
    }
    const auto step = [&](const std::vector<float>& positions, std::int64_t f, std::int64_t v) {
        return std::hypot(length(at(positions, f, v), at(positions, f - 1, v)), tau);
    };
    for (std::int64_t f = 1; f < pair.frame_count(); ++f) {
        for (std::int64_t v = 0; v < pair.vertex_count; ++v) {
            double speed = 0.0, steps = 0.0;
            for (std::int64_t g = std::max<std::int64_t>(1, f - 9); g <= f; ++g, ++steps)
                speed += step(pair.source, g, v);
            time += std::abs(step(pair.decoded, f, v) - step(pair.source, f, v)) / (speed / steps);
            ++time_count;
        }
    }
    EdgeDistortion found;
    found.space = space_count > 0.0 ? space / space_count : 0.0;
    found.time = time_count > 0.0 ? time / time_count : 0.0;
    found.total = std::hypot(found.space, 0.136 * found.time);
    return found;
}

TEST(EdgeDistortion, IsZeroOfACopy) {
    const EdgeDistortion found = measure(waving_grid(9, 5, 0.0f));
    EXPECT_EQ(found.space, 0.0);
    EXPECT_EQ(found.time, 0.0);
    EXPECT_EQ(found.total, 0.0);
}

// Edges at vertex 0 are 3 and 4 long and become 6 and 4: d = 1 and 0, m = 3/7, s² = (3 · 16 + 4 · 9) / (7 ·
// 49). At vertex 1, 3 and 5 become 6 and sqrt(52). At vertex 2, 4 and 5 become 4 and sqrt(52).
TEST(EdgeDistortion, HasAMovedVertexAsByHand) {
    Pair pair = right_triangle();
    pair.decoded = flat({{0, 0, 0}, {6, 0, 0}, {0, 4, 0}});
    const double long_edge = (std::sqrt(52.0) - 5.0) / 5.0;
    const auto deviation = [](double l1, double d1, double l2, double d2) {
        return std::sqrt(l1 * l2) / (l1 + l2) * std::abs(d1 - d2);  // of two weighted values
    };
    const double expected =
        (std::sqrt(12.0) / 7.0 + deviation(3, 1, 5, long_edge) + deviation(4, 0, 5, long_edge)) / 3.0;
    const EdgeDistortion found = measure(pair);
    EXPECT_NEAR(found.space, expected, 1e-12);
    EXPECT_EQ(found.time, 0.0);
    EXPECT_EQ(found.total, found.space);
}

TEST(EdgeDistortion, UniformScalingDeviatesNowhere) {
    Pair pair = waving_grid(8, 1, 0.0f);
    for (float& x : pair.decoded) x *= 2.0f;
    EXPECT_EQ(measure(pair).space, 0.0);
    for (std::size_t i = 0; i < pair.decoded.size(); i += 3) pair.decoded[i] *= 1.5f;
    EXPECT_GT(measure(pair).space, 0.1);  // scaling one axis is no uniform one
}

// Another motion every frame: edges keep their lengths, steps in time do not.
TEST(EdgeDistortion, RigidMotionsLeaveSpaceAlone) {
    Pair pair = waving_grid(8, 6, 0.0f);
    const std::size_t frame = pair.source.size() / 6;
    for (std::size_t i = 0; i < pair.source.size(); i += 3) {
        const double angle = 0.7 * static_cast<double>(i / frame);
        const double x = pair.source[i], y = pair.source[i + 1];
        pair.decoded[i] = static_cast<float>(std::cos(angle) * x - std::sin(angle) * y + 2.0);
        pair.decoded[i + 1] = static_cast<float>(std::sin(angle) * x + std::cos(angle) * y - 1.0);
    }
    const EdgeDistortion found = measure(pair);
    EXPECT_LT(found.space, 1e-6);
    EXPECT_GT(found.time, 1.0);
    EXPECT_NEAR(found.total, EdgeDistortionMeter::kTimeWeight * found.time, 1e-6);
}

TEST(EdgeDistortion, AConstantShiftIsNoDistortion) {
    Pair pair = waving_grid(8, 6, 0.0f);
    for (std::size_t i = 0; i < pair.decoded.size(); i += 3) pair.decoded[i] += 4.0f;
    const EdgeDistortion found = measure(pair);
    EXPECT_LT(found.space, 1e-6);
    EXPECT_LT(found.time, 1e-5);
}

// At rest t = τ = 0.005; the whole decoded clip is 0.012 off in every other frame, so that t̂ = 0.013, and the
// relative difference 8/5.
TEST(EdgeDistortion, HasJitterAsByHand) {
    Pair pair{3, {{0, 1, 2}}, {}, {}};
    for (int f = 0; f < 30; ++f) {
        const float off = f % 2 == 0 ? 0.0f : 0.012f;
        for (const Point& p : {Point{0, 0, 0}, Point{3, 0, 0}, Point{0, 4, 0}}) {
            pair.source.insert(pair.source.end(), p.begin(), p.end());
            for (std::size_t axis = 0; axis < 3; ++axis)
                pair.decoded.push_back(p[axis] + (axis == 2 ? off : 0.0f));
        }
    }
    const EdgeDistortion found = measure(pair);
    EXPECT_EQ(found.space, 0.0);
    EXPECT_NEAR(found.time, 1.6, 1e-6);
    EXPECT_NEAR(found.total, 0.136 * 1.6, 1e-6);
}

// Vertex 1 stops after two steps of sqrt(τ² + 0.012²) = 0.013: T falls from 0.013 as steps at rest come in,
// and the first ones leave the window.
TEST(EdgeDistortion, TakesTheSpeedOverTheWindow) {
    Pair pair{2, {{0, 1, 1}}, {}, {}};
    for (int f = 0; f < 15; ++f) {
        const float way = 0.012f * static_cast<float>(std::min(f, 2));
        const auto source = flat({{0, 0, 0}, {5, 0, way}});
        const auto decoded = flat({{0, 0, 0}, {5, f % 2 == 0 || f < 12 ? 0.0f : 0.012f, way}});
        pair.source.insert(pair.source.end(), source.begin(), source.end());
        pair.decoded.insert(pair.decoded.end(), decoded.begin(), decoded.end());
    }
    // Off in frame 13 alone: steps 13 and 14 are 0.013 instead of 0.005, and steps 4 … 14 are all at rest.
    EXPECT_NEAR(measure(pair).time, 2.0 * 1.6 / (2.0 * 14.0), 1e-6);
    // Off in frame 3 alone: steps 3 and 4, over means of 0.031 / 3 and 0.036 / 4.
    for (std::size_t f = 0; f < 15; ++f) pair.decoded[6 * f + 4] = f == 3 ? 0.012f : 0.0f;
    EXPECT_NEAR(measure(pair).time, (0.008 * 3 / 0.031 + 0.008 * 4 / 0.036) / (2.0 * 14.0), 1e-6);
}

TEST(EdgeDistortion, IsAsDefined) {
    Pair pair = waving_grid(50, 14, 0.05f);  // more than one block of vertices
    pair.triangles.push_back({0, 0, 1});     // degenerate, and an edge that is there already
    pair.triangles.push_back({3, 1000, 3});
    for (int axis = 0; axis < 3; ++axis)  // an edge without length in one frame
        pair.source[static_cast<std::size_t>(3 * 1 + axis)] = pair.source[static_cast<std::size_t>(axis)];
    pair.vertex_count = 50 * 50;
    const EdgeDistortion expected = by_definition(pair), found = measure(pair);
    EXPECT_NEAR(found.space, expected.space, 1e-9 * expected.space);
    EXPECT_NEAR(found.time, expected.time, 1e-6 * expected.time);  // speeds are kept as float32
    EXPECT_NEAR(found.total, expected.total, 1e-6 * expected.total);
}

TEST(EdgeDistortion, IsTheSameForAnyRunsAndExecutors) {
    const Pair pair = waving_grid(70, 25, 0.02f);
    const EdgeDistortion whole = measure(pair);
    const auto source = pair.view(pair.source), decoded = pair.view(pair.decoded);
    for (const std::int64_t run : {1, 4, 11, 24}) {
        EdgeDistortionMeter meter(pair.triangles, pair.vertex_count);
        for (std::int64_t f = 0; f < 25; f += run) {
            const std::int64_t end = std::min<std::int64_t>(25, f + run);
            meter.add(source.frames(f, end), decoded.frames(f, end),
                      ShuffledExecutor(static_cast<std::uint64_t>(run)));
        }
        const EdgeDistortion found = meter.finish();
        EXPECT_EQ(found.space, whole.space) << run;
        EXPECT_EQ(found.time, whole.time) << run;
        EXPECT_EQ(found.total, whole.total) << run;
    }
}

TEST(EdgeDistortion, NeedsNeitherEdgesNorFramesNorVertices) {
    Pair points{2,
                {},
                flat({{0, 0, 0}, {1, 0, 0}, {0, 0, 0}, {1, 0, 0}}),
                flat({{0, 0, 0}, {1, 0, 0}, {0, 0, 0}, {1, 0, 1}})};
    EXPECT_EQ(measure(points).space, 0.0);
    EXPECT_GT(measure(points).time, 0.0);
    EXPECT_EQ(EdgeDistortionMeter({}, 3).finish().total, 0.0);
    EdgeDistortionMeter nothing({}, 0);
    nothing.add({}, {}, SerialExecutor());
    EXPECT_EQ(nothing.finish().total, 0.0);
    // All in one point, D = 0: no edge has a length, and steps are as long as the vertices move.
    Pair collapsed{3, {{0, 1, 2}}, std::vector<float>(18, 1.0f), std::vector<float>(18, 1.0f)};
    collapsed.decoded.back() = 2.0f;
    EXPECT_EQ(measure(collapsed).total, 0.0);
}

}  // namespace
}  // namespace batchenc
