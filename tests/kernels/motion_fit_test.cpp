#include "kernels/motion_fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "tests/support/sample_clips.h"

namespace batchenc {
namespace {

const SerialExecutor kSerial;

TEST(MotionNeighbours, OrderHasEveryVertexOnceAndLooksBackwards) {
    for (const auto& [name, clip] : test::every_kind_of_clip()) {
        const MeshTopology mesh(clip.triangles, clip.vertex_count);
        const auto vertex_count = static_cast<std::size_t>(clip.vertex_count);
        const auto neighbours =
            MotionNeighbours::of(mesh, std::span(clip.positions).first(3 * vertex_count), kSerial);
        EXPECT_EQ(std::set<std::int32_t>(neighbours.order.begin(), neighbours.order.end()).size(),
                  vertex_count)
            << name;
        ASSERT_EQ(neighbours.level_first.size(), static_cast<std::size_t>(MotionNeighbours::kLevels + 2));
        EXPECT_EQ(neighbours.level_first.back(), clip.vertex_count);
        std::size_t level = 0;
        for (std::size_t k = 0; k < vertex_count; ++k) {
            while (neighbours.level_first[level + 1] <= static_cast<std::int32_t>(k)) ++level;
            // Within the coarse part any earlier place will do, in a level only those before it.
            const auto end = level == 0 ? static_cast<std::int32_t>(k) : neighbours.level_first[level];
            double sum = 0.0;
            int count = 0;
            for (std::size_t i = 0; i < MotionNeighbours::kCount; ++i) {
                const std::int32_t place = neighbours.places[k * MotionNeighbours::kCount + i];
                const float weight = neighbours.weights[k * MotionNeighbours::kCount + i];
                sum += static_cast<double>(weight);
                if (place == clip.vertex_count) {
                    EXPECT_EQ(weight, 0.0f);
                } else {
                    EXPECT_TRUE(place >= 0 && place < end) << name << ", place " << k;
                    ++count;
                }
            }
            EXPECT_NEAR(sum, count > 0 ? 1.0 : 0.0, 1e-5) << name << ", place " << k;
            EXPECT_TRUE(count > 0 || k == 0) << name << ", place " << k;
        }
    }
}

/// Runs a clip of whole points through a fit; returns the sum of the residuals' magnitudes in each frame.
std::vector<double> residuals_of(const MeshTopology& mesh,
                                 const std::vector<std::vector<LatticePoint>>& clip) {
    std::vector<float> first;
    for (const LatticePoint& p : clip[0])
        for (const std::int32_t x : p) first.push_back(static_cast<float>(x));
    const auto neighbours = MotionNeighbours::of(mesh, first, kSerial);
    MotionFit fit(neighbours, clip[0], std::vector<float>(first.size(), 0.0f), 1);
    std::vector<double> sums(clip.size(), 0.0);
    MotionFit::Batch batch;
    for (std::size_t f = 1; f < clip.size(); ++f) {
        const auto frame = static_cast<std::int64_t>(f);
        for (std::int64_t k = 0; k < mesh.vertex_count(); ++k) {
            fit.predict(frame, k, 1, batch);
            const LatticePoint& point =
                clip[f][static_cast<std::size_t>(neighbours.order[static_cast<std::size_t>(k)])];
            for (std::size_t c = 0; c < 3; ++c) {
                batch.point[0][c] = point[c];
                sums[f] += std::abs(point[c] - batch.whole[0][c]);
            }
            batch.point[0][3] = 0;
            fit.record(frame, k, 1, batch);
        }
        fit.fit(frame, 0, (mesh.vertex_count() + MotionFit::kGroup - 1) / MotionFit::kGroup);
    }
    return sums;
}

TEST(MotionFit, FollowsTranslationsFromTheSecondVertexOn) {
    const MeshSequence sheet = test::sheet(9, 8, 1);
    const MeshTopology mesh(sheet.triangles, sheet.vertex_count);
    std::vector<std::vector<LatticePoint>> clip;
    for (std::int32_t f = 0; f < 6; ++f) {
        std::vector<LatticePoint>& frame = clip.emplace_back();
        for (std::int32_t v = 0; v < 72; ++v)
            frame.push_back({100 * (v % 9) + 50 * f, 100 * (v / 9), -7 * f * f});
    }
    const auto sums = residuals_of(mesh, clip);
    // Only the first vertex, which has nobody before it, can surprise, and the rounding of what it leaves.
    for (std::size_t f = 1; f < clip.size(); ++f) EXPECT_LE(sums[f], 50.0 + 7.0 * 11.0 + 72.0) << f;
    EXPECT_LE(sums[5], sums[1]);
}

TEST(MotionFit, LearnsWhatTheMeshDoesNotSay) {
    // Every second row moves twice as far as the others: weights from the first frame are wrong, those of a
    // few frames are not.
    const MeshSequence sheet = test::sheet(12, 12, 1);
    const MeshTopology mesh(sheet.triangles, sheet.vertex_count);
    std::vector<std::vector<LatticePoint>> clip;
    for (std::int32_t f = 0; f < 30; ++f) {
        std::vector<LatticePoint>& frame = clip.emplace_back();
        const auto wave = static_cast<std::int32_t>(std::lround(300.0 * std::sin(0.9 * f)));
        for (std::int32_t v = 0; v < 144; ++v)
            frame.push_back({100 * (v % 12), 100 * (v / 12), (1 + v / 12 % 2) * wave});
    }
    const auto sums = residuals_of(mesh, clip);
    EXPECT_LT(20.0 * sums[29], sums[1]);
}

TEST(MotionFit, StaysFiniteWhateverItIsGiven) {
    const MeshSequence sheet = test::sheet(6, 6, 1);
    const MeshTopology mesh(sheet.triangles, sheet.vertex_count);
    std::vector<std::vector<LatticePoint>> clip;
    for (std::int32_t f = 0; f < 40; ++f) {
        std::vector<LatticePoint>& frame = clip.emplace_back();
        for (std::int32_t v = 0; v < 36; ++v) {
            const std::int32_t far = 1 << 29;
            frame.push_back(
                {(f + v) % 2 == 0 ? far : -far, (f * v) % 3 == 0 ? far : 0, f % 5 == 0 ? -far : v});
        }
    }
    for (const double sum : residuals_of(mesh, clip)) EXPECT_TRUE(std::isfinite(sum));
}

TEST(MotionFit, ClassesAreTwoAnOctave) {
    EXPECT_DOUBLE_EQ(MotionFit::magnitude_of_class(0), 0.03);
    EXPECT_DOUBLE_EQ(MotionFit::magnitude_of_class(2), 0.06);
    EXPECT_NEAR(MotionFit::magnitude_of_class(1), 0.03 * std::sqrt(2.0), 1e-12);
}

}  // namespace
}  // namespace batchenc
