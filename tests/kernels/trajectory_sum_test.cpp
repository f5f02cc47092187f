#include "kernels/trajectory_sum.h"

#include <gtest/gtest.h>

#include <random>

namespace batchenc {
namespace {

// The same operations one after another give the same bits.
TEST(TrajectorySum, IsThatOfPlainLoops) {
    std::mt19937 random(1);
    std::normal_distribution<float> normal;
    for (const std::int64_t vertices : {1, 2, 15, 16, 17, 31, 32, 100}) {
        for (const std::int64_t components : {0, 1, 2, 7}) {
            const std::int64_t fields = 3 + components;
            const std::int64_t blocks = (vertices + kTrajectoryLanes - 1) / kTrajectoryLanes;
            std::vector<std::int32_t> where;
            for (std::int64_t k = 0; k < vertices; ++k) where.push_back(static_cast<std::int32_t>(3 * k + 1));
            std::vector<float> values(static_cast<std::size_t>(blocks * fields * kTrajectoryLanes), 0.0f);
            std::vector<float> weights(static_cast<std::size_t>(3 * fields));
            for (float& w : weights) w = normal(random);
            const std::array<float, 3> origin = {normal(random), normal(random), normal(random)};
            const std::size_t all = 3 * (3 * static_cast<std::size_t>(vertices) + 2);
            std::vector<float> expected(all, -7.0f), out(all, -7.0f);
            for (std::int64_t k = 0; k < vertices; ++k) {
                std::array<float, 3> p = origin;
                for (std::int64_t l = 0; l < fields; ++l) {
                    const float value = normal(random);
                    values[TrajectoryCluster::field_index(k, l, components)] = value;
                    for (std::size_t axis = 0; axis < 3; ++axis) {
                        const float product = value * weights[static_cast<std::size_t>(3 * l) + axis];
                        p[axis] += product;
                    }
                }
                std::copy(p.begin(), p.end(), expected.begin() + 3 * where[static_cast<std::size_t>(k)]);
            }
            sum_trajectories({where, values.data(), components}, weights.data(), origin.data(), out.data());
            EXPECT_EQ(out, expected) << vertices << " vertices, " << components << " components";
        }
    }
}

TEST(TrajectorySum, PutsFieldsOfSixteenVerticesTogether) {
    EXPECT_EQ(TrajectoryCluster::field_index(0, 0, 4), 0u);
    EXPECT_EQ(TrajectoryCluster::field_index(15, 0, 4), 15u);
    EXPECT_EQ(TrajectoryCluster::field_index(3, 2, 4), 2 * 16 + 3u);
    EXPECT_EQ(TrajectoryCluster::field_index(18, 1, 4), (7 + 1) * 16 + 2u);
}

}  // namespace
}  // namespace batchenc
