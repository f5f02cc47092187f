#include "codecs/segmentation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "kernels/local_frame.h"
#include "tests/support/sample_clips.h"

namespace batchenc {
namespace {

const SerialExecutor kSerial;

constexpr SegmentationMethod kMethods[] = {SegmentationMethod::kRegionGrowing,
                                           SegmentationMethod::kClustering, SegmentationMethod::kAdaptive,
                                           SegmentationMethod::kRigid};

Segmentation segment(const MeshSequence& clip, const SegmentationParameters& parameters) {
    auto segmentation = segment_clip(clip.view(), clip.triangles, parameters, kSerial);
    EXPECT_TRUE(segmentation);
    return std::move(*segmentation);
}

/// Three bodies side by side, six columns each: one stands, one turns about z, one about x.
MeshSequence three_bodies() {
    MeshSequence clip = test::sheet(18, 6, 20, [](const std::array<double, 3>& p, double time) {
        const double c = std::cos(2.0 * time), s = std::sin(2.0 * time);
        if (p[0] < 0.33) return p;
        if (p[0] < 0.66) return std::array<double, 3>{2.0 + c * p[0] - s * p[1], s * p[0] + c * p[1], p[2]};
        return std::array<double, 3>{4.0 + p[0], c * p[1] - s * p[2], s * p[1] + c * p[2]};
    });
    std::erase_if(clip.triangles, [](const Triangle& t) { return t[0] % 18 / 6 != t[1] % 18 / 6; });
    return clip;
}

TEST(Segmentation, FindsBodiesThatMoveRigidly) {
    const MeshSequence clip = three_bodies();
    for (const SegmentationMethod method :
         {SegmentationMethod::kClustering, SegmentationMethod::kAdaptive, SegmentationMethod::kRigid}) {
        const Segmentation found = segment(clip, {.method = method, .clusters = 3});
        ASSERT_EQ(found.cluster_count(), 3) << to_name(method);
        std::set<std::int32_t> of_body[3];
        for (std::int64_t v = 0; v < clip.vertex_count; ++v)
            of_body[v % 18 / 6].insert(found.labels[static_cast<std::size_t>(v)]);
        for (const auto& labels : of_body) EXPECT_EQ(labels.size(), 1u) << to_name(method);
        EXPECT_LT(found.average_deviation(), 1e-9) << to_name(method);
    }
}

TEST(Segmentation, StopsByItselfWhereNoClusterPays) {
    const MeshSequence clip = three_bodies();
    for (const SegmentationMethod method : kMethods) {
        EXPECT_EQ(segment(clip, {.method = method, .clusters = 0}).cluster_count(), 3) << to_name(method);
        const auto count = [&](std::int32_t clusters, double threshold) {
            return segment(clip, {.method = method, .clusters = clusters, .threshold = threshold})
                .cluster_count();
        };
        EXPECT_EQ(count(40, 1e-4), 3) << to_name(method) << ": three bring the deviation to zero";
        EXPECT_EQ(count(2, 1e-4), 2) << to_name(method);
        EXPECT_EQ(count(40, 1.0), 1) << to_name(method) << ": nothing steps as far as the clip is large";
    }
}

TEST(Segmentation, IsDefinedForEveryKindOfClipAndAnyExecutor) {
    for (const auto& [name, clip] : test::every_kind_of_clip()) {
        for (const SegmentationMethod method : kMethods) {
            for (const std::int32_t clusters : {0, 1, 3, 12, 500}) {
                const std::string what =
                    name + ", " + std::string(to_name(method)) + " " + std::to_string(clusters);
                const SegmentationParameters parameters{.method = method, .clusters = clusters};
                const auto found = segment_clip(clip.view(), clip.triangles, parameters, kSerial);
                ASSERT_TRUE(found) << what;
                const std::int32_t count = found->cluster_count();
                EXPECT_GE(count, 1) << what;
                EXPECT_LE(count, clip.vertex_count) << what;
                if (clusters > 0) {
                    EXPECT_LE(count, clusters) << what;
                }
                if (count < clusters) {
                    EXPECT_FALSE(found->notes.empty()) << what;
                }
                ASSERT_EQ(found->labels.size(), static_cast<std::size_t>(clip.vertex_count)) << what;
                for (const std::int32_t label : found->labels) {
                    ASSERT_GE(label, 0) << what;
                    ASSERT_LT(label, count) << what;
                }
                for (const Triangle& t : found->seed_triangles) {
                    for (const std::int32_t v : t) {
                        ASSERT_GE(v, 0) << what;
                        ASSERT_LT(v, clip.vertex_count) << what;
                    }
                }
                ASSERT_EQ(found->cluster_deviations.size(), static_cast<std::size_t>(count)) << what;
                for (const double deviation : found->cluster_deviations)
                    EXPECT_TRUE(std::isfinite(deviation) && deviation >= 0.0) << what;
                for (std::uint64_t seed = 0; seed < 3; ++seed) {
                    const auto again =
                        segment_clip(clip.view(), clip.triangles, parameters, ShuffledExecutor(seed));
                    EXPECT_EQ(again->labels, found->labels) << what;
                    EXPECT_EQ(again->seed_triangles, found->seed_triangles) << what;
                    EXPECT_EQ(again->deviations, found->deviations) << what;
                }
            }
        }
    }
}

// Also where seed triangles share vertices, and after seeds have moved and clusters were dissolved.
TEST(Segmentation, CornersOfASeedTriangleBelongToTheFirstClusterThatHasThem) {
    for (const std::int64_t side : {12, 14, 20}) {
        const MeshSequence clip = test::sheet(side, side, 12);
        for (const SegmentationMethod method : kMethods) {
            for (const std::int32_t clusters : {8, 24, 40, 60, 120}) {
                const Segmentation found = segment(clip, {.method = method, .clusters = clusters});
                std::set<std::int32_t> seen;
                for (std::int32_t i = 0; i < found.cluster_count(); ++i) {
                    for (const std::int32_t v : found.seed_triangles[static_cast<std::size_t>(i)]) {
                        if (!seen.insert(v).second) continue;
                        EXPECT_EQ(found.labels[static_cast<std::size_t>(v)], i)
                            << to_name(method) << " " << clusters << ", side " << side << ", vertex " << v;
                    }
                }
            }
        }
    }
}

TEST(Segmentation, DeviationsAreThoseOfTheDefinition) {
    const MeshSequence clip = test::sheet(15, 11, 23);
    const auto theta = [&](std::size_t v, const Triangle& triangle) {
        const LocalFrameTrack track = triangle_track(clip.view(), triangle);
        double sum = 0.0;
        std::array<double, 3> before{};
        for (std::int64_t f = 0; f < clip.frame_count; ++f) {
            const float* p = clip.view().at(f, static_cast<std::int64_t>(v));
            for (std::size_t axis = 0; axis < 3; ++axis) {
                double q = 0.0;
                for (std::size_t c = 0; c < 3; ++c)
                    q += static_cast<double>(track.row(static_cast<int>(3 * axis + c))[f]) *
                         (static_cast<double>(p[c]) -
                          static_cast<double>(track.row(static_cast<int>(9 + c))[f]));
                if (f > 0) sum += (q - before[axis]) * (q - before[axis]);
                before[axis] = q;
            }
        }
        return sum;
    };
    for (const SegmentationMethod method : kMethods) {
        const Segmentation found = segment(clip, {.method = method, .clusters = 6});
        std::set<std::int32_t> corners;
        for (const Triangle& t : found.seed_triangles) corners.insert(t.begin(), t.end());
        std::vector<double> sums(found.seed_triangles.size(), 0.0), counts(sums.size(), 0.0);
        for (std::size_t v = 0; v < found.labels.size(); ++v) {
            if (corners.contains(static_cast<std::int32_t>(v))) continue;
            const auto i = static_cast<std::size_t>(found.labels[v]);
            const double expected = theta(v, found.seed_triangles[i]);
            EXPECT_NEAR(found.deviations[v], expected, 1e-3 * expected + 1e-9) << to_name(method) << " " << v;
            sums[i] += expected;
            counts[i] += 1.0;
        }
        double mean = 0.0;
        for (std::size_t i = 0; i < sums.size(); ++i) {
            const double average = counts[i] > 0.0 ? sums[i] / counts[i] / 23.0 : 0.0;
            EXPECT_NEAR(found.cluster_deviations[i], average, 1e-3 * average + 1e-12) << to_name(method);
            mean += average / static_cast<double>(sums.size());
        }
        EXPECT_NEAR(found.average_deviation(), mean, 1e-3 * mean) << to_name(method);
    }
}

TEST(Segmentation, AdaptiveLeavesNoHandfulOfVertices) {
    // A bump of three vertices that dances by itself: the worst vertices of all, and no cluster of their own.
    const MeshSequence clip = test::sheet(20, 12, 25, [](const std::array<double, 3>& p, double time) {
        auto q = test::bend(p, time);
        if (p[0] == 0.5 && p[1] < 0.2) q[2] += std::sin(90.0 * time + 40.0 * p[1]);
        return q;
    });
    const Segmentation found = segment(clip, {.method = SegmentationMethod::kAdaptive, .clusters = 8});
    EXPECT_EQ(found.cluster_count(), 8);
    std::vector<int> sizes(8, 0);
    for (const std::int32_t label : found.labels) ++sizes[static_cast<std::size_t>(label)];
    for (const int size : sizes) EXPECT_GT(size, 4);
}

TEST(Segmentation, AdaptiveIsNoWorseThanClusteringAndRigidNoWorseThanAdaptive) {
    const MeshSequence clip = test::sheet(30, 20, 40);
    for (const std::int32_t clusters : {4, 8, 16}) {
        const double clustering = segment(clip, {.clusters = clusters}).average_deviation();
        const double adaptive = segment(clip, {.method = SegmentationMethod::kAdaptive, .clusters = clusters})
                                    .average_deviation();
        const double rigid =
            segment(clip, {.method = SegmentationMethod::kRigid, .clusters = clusters}).average_deviation();
        EXPECT_LE(adaptive, clustering) << clusters;
        EXPECT_LE(rigid, adaptive) << clusters;
    }
}

// Their squares do not fit into float32: nothing can be told apart, and nothing may break.
TEST(Segmentation, SurvivesHugeAndTinyCoordinates) {
    for (const double size : {1e-44, 1e-30, 1e18, 1e25, 1e37, 3e38}) {
        const MeshSequence clip = test::sheet(12, 12, 6, [size](const std::array<double, 3>& p, double time) {
            const auto q = test::bend(p, time);
            return std::array<double, 3>{0.2 * size * q[0], 0.2 * size * q[1], 0.2 * size * q[2]};
        });
        for (const SegmentationMethod method : kMethods) {
            for (const std::int32_t clusters : {0, 1, 7, 500}) {
                const Segmentation found = segment(clip, {.method = method, .clusters = clusters});
                for (const std::int32_t label : found.labels)
                    ASSERT_TRUE(label >= 0 && label < found.cluster_count()) << size;
                EXPECT_TRUE(std::isfinite(found.average_deviation())) << size << " " << to_name(method);
            }
        }
    }
}

TEST(Segmentation, AsManyClustersAsVerticesAreManyClusters) {
    const MeshSequence clip = test::sheet(20, 20, 12);
    for (const SegmentationMethod method : kMethods) {
        EXPECT_GT(segment(clip, {.method = method, .clusters = 400}).cluster_count(), 20) << to_name(method);
    }
}

TEST(Segmentation, OneFrameGoesToTheNearestSeed) {
    const MeshSequence clip = test::sheet(20, 1, 1);
    SegmentationParameters parameters;
    parameters.clusters = 2;
    const auto segmentation = segment_clip(clip.view(), clip.triangles, parameters, kSerial);
    ASSERT_TRUE(segmentation);
    EXPECT_NE(segmentation->labels.front(), segmentation->labels.back());
    int changes = 0;
    for (std::size_t v = 1; v < 20; ++v) changes += segmentation->labels[v] != segmentation->labels[v - 1];
    EXPECT_LE(changes, 5) << "two runs along the line, but for the two distant corners of each seed triangle";
}

TEST(Segmentation, SaysWhatItCannotDo) {
    const MeshSequence clip = test::sheet(4, 4, 3);
    SegmentationParameters parameters;
    parameters.method = static_cast<SegmentationMethod>(9);
    EXPECT_EQ(segment_clip(clip.view(), clip.triangles, parameters, kSerial).error().code,
              ErrorCode::kUnsupported);
    parameters = {};
    parameters.clusters = -1;
    EXPECT_EQ(segment_clip(clip.view(), clip.triangles, parameters, kSerial).error().code,
              ErrorCode::kInvalidArgument);
}

}  // namespace
}  // namespace batchenc
