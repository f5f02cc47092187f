#include "kernels/synthetic_clip.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <string>

namespace batchenc {
namespace {

const std::vector<std::string> kKinds = {"walker", "flag", "jelly", "medley"};

// What the kind has at least.
std::int64_t at_least(const std::string& kind, std::int64_t wanted) {
    return kind == "medley" ? std::max<std::int64_t>(wanted, 256) : wanted;
}

std::unique_ptr<SyntheticClip> make(const std::string& kind, std::int64_t vertex_count,
                                    std::uint64_t seed = 1) {
    auto clip = make_synthetic_clip(kind, vertex_count, seed);
    EXPECT_TRUE(clip) << clip.error().to_string();
    return std::move(*clip);
}

std::vector<float> frame_of(const SyntheticClip& clip, std::int64_t frame) {
    std::vector<float> positions(static_cast<std::size_t>(3 * clip.vertex_count()),
                                 std::numeric_limits<float>::quiet_NaN());
    clip.write_frame(frame, positions);
    return positions;
}

std::array<double, 3> corner(const std::vector<float>& positions, std::int32_t v) {
    const auto at = static_cast<std::size_t>(3 * v);
    return {positions[at], positions[at + 1], positions[at + 2]};
}

std::array<double, 3> doubled_area_vector(const std::vector<float>& positions, const Triangle& t) {
    const auto a = corner(positions, t[0]), b = corner(positions, t[1]), c = corner(positions, t[2]);
    std::array<double, 3> u{}, w{};
    for (std::size_t i = 0; i < 3; ++i) u[i] = b[i] - a[i], w[i] = c[i] - a[i];
    return {u[1] * w[2] - u[2] * w[1], u[2] * w[0] - u[0] * w[2], u[0] * w[1] - u[1] * w[0]};
}

double area(const std::vector<float>& positions, const Triangle& t) {
    const auto n = doubled_area_vector(positions, t);
    return 0.5 * std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
}

double volume(const std::vector<float>& positions, const std::vector<Triangle>& triangles) {
    double six = 0.0;
    for (const Triangle& t : triangles) {
        const auto n = doubled_area_vector(positions, t), a = corner(positions, t[0]);
        six += n[0] * a[0] + n[1] * a[1] + n[2] * a[2];
    }
    return six / 6.0;
}

struct Topology {
    int components = 0, boundary_edges = 0;
    bool manifold = true, all_used = true;
};

Topology topology_of(const SyntheticClip& clip) {
    Topology topology;
    std::map<std::pair<std::int32_t, std::int32_t>, int> edges;
    std::vector<std::int32_t> root(static_cast<std::size_t>(clip.vertex_count()));
    std::iota(root.begin(), root.end(), 0);
    std::vector<bool> used(root.size());
    const auto find = [&root](std::int32_t v) {
        while (root[static_cast<std::size_t>(v)] != v) v = root[static_cast<std::size_t>(v)];
        return v;
    };
    for (const Triangle& t : clip.triangles()) {
        for (std::size_t i = 0; i < 3; ++i) {
            ++edges[{t[i], t[(i + 1) % 3]}];
            root[static_cast<std::size_t>(find(t[i]))] = find(t[(i + 1) % 3]);
            used[static_cast<std::size_t>(t[i])] = true;
        }
    }
    for (const auto& [edge, count] : edges) {
        topology.manifold = topology.manifold && count == 1;  // each direction once: also consistently wound
        if (edges.count({edge.second, edge.first}) == 0) ++topology.boundary_edges;
    }
    for (std::size_t v = 0; v < root.size(); ++v)
        topology.components += root[v] == static_cast<std::int32_t>(v);
    topology.all_used = std::all_of(used.begin(), used.end(), [](bool u) { return u; });
    return topology;
}

TEST(SyntheticClip, HasTheWantedNumberOfVertices) {
    for (const std::string& kind : kKinds) {
        std::vector<std::int64_t> counts = {2500, 4001, 9999, 65536, 100003, 1000000};
        for (std::int64_t v = 64; v < 2000; v += v < 400 ? 1 : 13) counts.push_back(v);
        for (const std::int64_t count : counts) {
            const std::int64_t wanted = at_least(kind, count);
            const auto clip = make(kind, wanted);
            const auto miss = std::abs(static_cast<double>(clip->vertex_count() - wanted));
            ASSERT_LE(miss, 0.05 * static_cast<double>(wanted)) << kind << " " << wanted;
        }
    }
}

TEST(SyntheticClip, HasTheTopologyOfItsKind) {
    for (const std::int64_t wanted : {64, 65, 97, 500, 3000}) {
        for (const std::string& kind : kKinds) {
            SCOPED_TRACE(kind + " " + std::to_string(wanted));
            const Topology topology = topology_of(*make(kind, at_least(kind, wanted)));
            EXPECT_TRUE(topology.manifold);
            EXPECT_TRUE(topology.all_used);
            EXPECT_EQ(topology.components, kind == "walker" ? 6 : kind == "medley" ? 8 : 1);
            EXPECT_EQ(topology.boundary_edges > 0, kind == "flag" || kind == "medley");
        }
    }
}

TEST(SyntheticClip, IsTheSameForTheSameSeedAndAnyOrderOfFrames) {
    for (const std::string& kind : kKinds) {
        const auto clip = make(kind, 500, 7), again = make(kind, 500, 7), other = make(kind, 500, 8);
        EXPECT_EQ(clip->triangles(), again->triangles());
        const auto late = frame_of(*clip, 123), early = frame_of(*clip, 5);
        EXPECT_EQ(early, frame_of(*again, 5)) << kind;
        EXPECT_EQ(late, frame_of(*again, 123)) << kind;
        EXPECT_NE(late, frame_of(*other, 123)) << kind;
    }
}

TEST(SyntheticClip, IsFiniteAndOfHumanSizeForAsLongAsOneLikes) {
    for (const std::string& kind : kKinds) {
        const auto clip = make(kind, 300);
        for (const std::int64_t frame :
             {std::int64_t{0}, std::int64_t{1}, std::int64_t{1000}, std::int64_t{1000000}}) {
            const auto positions = frame_of(*clip, frame);
            for (std::size_t axis = 0; axis < 3; ++axis) {
                float low = positions[axis], high = positions[axis];
                for (std::size_t i = axis; i < positions.size(); i += 3) {
                    ASSERT_TRUE(std::isfinite(positions[i])) << kind << " " << frame;
                    low = std::min(low, positions[i]);
                    high = std::max(high, positions[i]);
                }
                EXPECT_LT(high - low, kind == "medley" ? 9.0f : 3.0f) << kind << " " << frame;
                EXPECT_GT(high - low, 0.05f) << kind << " " << frame;
            }
        }
    }
}

TEST(SyntheticClip, MovesSmoothlyAndNeverReturns) {
    for (const std::string& kind : kKinds) {
        const auto clip = make(kind, 400, 3);
        const auto first = frame_of(*clip, 0);
        auto before = first;
        for (std::int64_t frame = 1; frame <= 600; ++frame) {
            const auto now = frame_of(*clip, frame);
            double largest = 0.0, since_first = 0.0;
            for (std::size_t i = 0; i < now.size(); ++i) {
                largest = std::max(largest, std::abs(static_cast<double>(now[i]) - before[i]));
                since_first += std::abs(static_cast<double>(now[i]) - first[i]);
            }
            ASSERT_LT(largest * clip->fps(), kind == "medley" ? 16.0 : 12.0) << kind << " " << frame;  // m/s
            before = now;
            if (kind == "medley" && frame < 30) continue;  // which sets out from rest, in one body of three
            ASSERT_GT(largest * clip->fps(), 0.02) << kind << " " << frame;
            ASSERT_GT(since_first / static_cast<double>(now.size()), 0.002) << kind << " " << frame;
        }
    }
}

TEST(SyntheticClip, KeepsEveryTriangleFromDegenerating) {
    for (const std::string& kind : kKinds) {
        for (const std::int64_t wanted : {64, 1500}) {
            for (const std::uint64_t seed : {1, 2, 3}) {
                const auto clip = make(kind, at_least(kind, wanted), seed);
                for (std::int64_t frame = 0; frame < 400; frame += 3) {
                    const auto positions = frame_of(*clip, frame);
                    double least = 1e300, sum = 0.0;
                    for (const Triangle& t : clip->triangles()) {
                        least = std::min(least, area(positions, t));
                        sum += area(positions, t);
                    }
                    const double mean = sum / static_cast<double>(clip->triangles().size());
                    ASSERT_GT(least, 0.01 * mean)
                        << kind << " " << wanted << " seed " << seed << " frame " << frame;
                }
            }
        }
    }
}

TEST(SyntheticClip, IsWoundSoThatClosedBodiesHoldVolume) {
    for (const std::string kind : {"walker", "jelly"}) {
        const auto clip = make(kind, 2000);
        const double at_rest = volume(frame_of(*clip, 0), clip->triangles());
        EXPECT_GT(at_rest, 0.02) << kind;
        for (const std::int64_t frame : {17, 60, 211, 305}) {
            const double now = volume(frame_of(*clip, frame), clip->triangles());
            EXPECT_NEAR(now / at_rest, 1.0, kind == "jelly" ? 0.35 : 0.08) << kind << " " << frame;
        }
    }
}

TEST(SyntheticClip, HoldsTheFlagAtItsPole) {
    const auto clip = make("flag", 600);
    const auto first = frame_of(*clip, 0), later = frame_of(*clip, 77);
    int still = 0;
    for (std::size_t v = 0; v < first.size() / 3; ++v) {
        still += std::equal(first.begin() + 3 * static_cast<std::ptrdiff_t>(v),
                            first.begin() + 3 * static_cast<std::ptrdiff_t>(v) + 3,
                            later.begin() + 3 * static_cast<std::ptrdiff_t>(v));
    }
    EXPECT_EQ(still, 20);  // the 20 rows of 30
}

TEST(SyntheticClip, StretchesNoThreadOfTheFlagMuch) {
    const auto clip = make("flag", 600);
    const auto length = [](const std::vector<float>& positions, std::int32_t row) {
        double sum = 0.0;
        for (std::int32_t v = 30 * row; v < 30 * row + 29; ++v) {
            const auto a = corner(positions, v), b = corner(positions, v + 1);
            sum += std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
        }
        return sum;
    };
    for (const std::int64_t frame : {0, 50, 333}) {
        const auto positions = frame_of(*clip, frame);
        for (const std::int32_t row : {0, 9, 19}) EXPECT_NEAR(length(positions, row), 1.8, 0.1);
    }
}

TEST(SyntheticMedley, LetsOneBodyPerformAtATime) {
    const auto clip = make("medley", 600, 5);
    const auto walker = make("walker", 200, 5),
               flag = make("flag", (clip->vertex_count() - walker->vertex_count()) / 2, 5);
    const auto first_of_flag = static_cast<std::size_t>(walker->vertex_count());
    const std::size_t first_of_jelly = first_of_flag + static_cast<std::size_t>(flag->vertex_count());
    std::vector<int> performers;
    auto before = frame_of(*clip, 0);
    for (std::int64_t frame = 1; frame < 3000; ++frame) {
        const auto now = frame_of(*clip, frame);
        std::array<double, 3> step{};
        for (std::size_t v = 0; v < now.size() / 3; ++v) {
            const std::size_t body = v < first_of_flag ? 0 : v < first_of_jelly ? 1 : 2;
            for (std::size_t i = 3 * v; i < 3 * v + 3; ++i)
                step[body] = std::max(step[body], std::abs(static_cast<double>(now[i]) - before[i]));
        }
        const auto moving = static_cast<int>(std::max_element(step.begin(), step.end()) - step.begin());
        for (int body = 0; body < 3; ++body) {
            if (body != moving) {
                ASSERT_EQ(step[static_cast<std::size_t>(body)], 0.0) << frame;
            }
        }
        if (performers.empty() || performers.back() != moving) performers.push_back(moving);
        before = now;
    }
    EXPECT_EQ(performers, (std::vector<int>{0, 1, 2, 0, 1, 2}));
}

TEST(SyntheticMedley, ActsOfOneBodyDiffer) {
    // No frame of the walker's first act is what its second has: two centimetres a vertex off, square metres.
    const auto clip = make("medley", 600, 5);
    const auto count = static_cast<std::size_t>(3 * make("walker", 200, 5)->vertex_count());
    const auto distance = [&](std::int64_t a, std::int64_t b) {
        const auto at_a = frame_of(*clip, a), at_b = frame_of(*clip, b);
        double sum = 0.0;
        for (std::size_t i = 0; i < count; ++i) sum += std::pow(static_cast<double>(at_a[i]) - at_b[i], 2);
        return sum;
    };
    double nearest = 1e300;
    for (std::int64_t frame = 0; frame < 350; ++frame) nearest = std::min(nearest, distance(frame, 2000));
    EXPECT_GT(nearest, 0.05);
}

// A codec must not find the values on a grid: hardly any two are equal.
TEST(SyntheticClip, HasContinuousValues) {
    for (const std::string& kind : kKinds) {
        auto positions = frame_of(*make(kind, 5000), 33);
        std::sort(positions.begin(), positions.end());
        const auto distinct = std::unique(positions.begin(), positions.end()) - positions.begin();
        EXPECT_GT(static_cast<double>(distinct), 0.97 * static_cast<double>(positions.size())) << kind;
    }
}

TEST(SyntheticClip, RefusesUnknownKindsAndCounts) {
    const auto unknown = make_synthetic_clip("robot", 100, 1);
    ASSERT_FALSE(unknown);
    EXPECT_EQ(unknown.error().code, ErrorCode::kInvalidArgument);
    for (const std::string& kind : kKinds) EXPECT_NE(unknown.error().message.find(kind), std::string::npos);
    for (const std::int64_t count :
         {std::int64_t{-1}, std::int64_t{0}, std::int64_t{63}, std::int64_t{1000001}}) {
        const auto clip = make_synthetic_clip("flag", count, 1);
        ASSERT_FALSE(clip);
        EXPECT_EQ(clip.error().code, ErrorCode::kInvalidArgument);
    }
}

}  // namespace
}  // namespace batchenc
