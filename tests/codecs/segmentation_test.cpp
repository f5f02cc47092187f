#include "codecs/segmentation.h"

#include <gtest/gtest.h>

#include <set>

#include "tests/support/sample_clips.h"

namespace batchenc {
namespace {

const SerialExecutor kSerial;

TEST(Segmentation, SeparatesBodiesThatMoveRigidly) {
    // The left half stands still, the right half turns about z.
    const MeshSequence clip = test::sheet(16, 6, 20, [](const std::array<double, 3>& p, double time) {
        if (p[0] < 0.5) return p;
        const double a = 2.0 * time;
        return std::array<double, 3>{2.0 + std::cos(a) * p[0] - std::sin(a) * p[1],
                                     std::sin(a) * p[0] + std::cos(a) * p[1], p[2]};
    });
    SegmentationParameters parameters;
    parameters.clusters = 2;
    const auto segmentation = segment_clip(clip.view(), clip.triangles, parameters, kSerial);
    ASSERT_TRUE(segmentation);
    std::set<std::int32_t> left, right;
    for (std::int64_t v = 0; v < clip.vertex_count; ++v) {
        (v % 16 < 8 ? left : right).insert(segmentation->labels[static_cast<std::size_t>(v)]);
    }
    EXPECT_EQ(left.size(), 1u);
    EXPECT_EQ(right.size(), 1u);
    EXPECT_NE(*left.begin(), *right.begin());
}

TEST(Segmentation, IsDefinedForEveryKindOfClipAndAnyExecutor) {
    for (const auto& [name, clip] : test::every_kind_of_clip()) {
        for (const std::int32_t clusters : {1, 3, 500}) {
            SegmentationParameters parameters;
            parameters.clusters = clusters;
            const auto segmentation = segment_clip(clip.view(), clip.triangles, parameters, kSerial);
            ASSERT_TRUE(segmentation) << name;
            EXPECT_GE(segmentation->cluster_count(), 1) << name;
            EXPECT_LE(segmentation->cluster_count(), std::min<std::int64_t>(clusters, clip.vertex_count))
                << name;
            if (segmentation->cluster_count() < clusters) {
                EXPECT_FALSE(segmentation->notes.empty()) << name;
            }
            for (const std::int32_t label : segmentation->labels) {
                ASSERT_GE(label, 0);
                ASSERT_LT(label, segmentation->cluster_count());
            }
            for (std::uint64_t seed = 0; seed < 3; ++seed) {
                EXPECT_EQ(
                    segment_clip(clip.view(), clip.triangles, parameters, ShuffledExecutor(seed))->labels,
                    segmentation->labels)
                    << name;
            }
        }
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
    parameters.method = SegmentationMethod::kAdaptive;
    EXPECT_EQ(segment_clip(clip.view(), clip.triangles, parameters, kSerial).error().code,
              ErrorCode::kUnsupported);
    parameters = {};
    parameters.clusters = 0;
    EXPECT_EQ(segment_clip(clip.view(), clip.triangles, parameters, kSerial).error().code,
              ErrorCode::kInvalidArgument);
}

}  // namespace
}  // namespace batchenc
