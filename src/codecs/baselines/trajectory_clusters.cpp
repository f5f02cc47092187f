#include "codecs/baselines/trajectory_clusters.h"

#include <algorithm>
#include <limits>

#include "codecs/rlpca_clusters.h"

namespace batchenc {
namespace {

constexpr int kMostRounds = 10;
constexpr std::int64_t kVerticesAtOnce = 64;

/// F × 3V: the coordinates of all vertices along time, each about its mean.
ColMajorMatrixXf trajectories_of(PositionsView positions, const Executor& executor) {
    ColMajorMatrixXf trajectories(positions.frame_count(), 3 * positions.vertex_count());
    executor.for_each(
        (positions.vertex_count() + kVerticesAtOnce - 1) / kVerticesAtOnce, [&](std::int64_t block) {
            const std::int64_t first = block * kVerticesAtOnce;
            const std::int64_t end = std::min(first + kVerticesAtOnce, positions.vertex_count());
            // About the first frame, so that float32 keeps the digits, and then about the mean.
            for (std::int64_t f = 0; f < positions.frame_count(); ++f) {
                for (std::int64_t v = first; v < end; ++v) {
                    for (std::int64_t c = 0; c < 3; ++c)
                        trajectories(f, 3 * v + c) = positions.at(f, v)[c] - positions.at(0, v)[c];
                }
            }
            for (std::int64_t column = 3 * first; column < 3 * end; ++column)
                trajectories.col(column).array() -=
                    static_cast<float>(trajectories.col(column).cast<double>().mean());
        });
    return trajectories;
}

ColMajorMatrixXf columns_of(const ColMajorMatrixXf& trajectories, const std::vector<std::int32_t>& members) {
    ColMajorMatrixXf columns(trajectories.rows(), 3 * static_cast<Eigen::Index>(members.size()));
    for (std::size_t k = 0; k < members.size(); ++k)
        columns.middleCols(3 * static_cast<Eigen::Index>(k), 3) = trajectories.middleCols(3 * members[k], 3);
    return columns;
}

std::vector<std::vector<std::int32_t>> members_of(std::span<const std::int32_t> labels,
                                                  std::int32_t cluster_count) {
    std::vector<std::vector<std::int32_t>> members(static_cast<std::size_t>(cluster_count));
    for (std::size_t v = 0; v < labels.size(); ++v)
        members[static_cast<std::size_t>(labels[v])].push_back(static_cast<std::int32_t>(v));
    return members;
}

/// Gives each vertex of [first, end) the cluster that leaves least of it.
void assign(const ColMajorMatrixXf& trajectories, const std::vector<ColMajorMatrixXf>& bases,
            const std::vector<std::vector<std::int32_t>>& members, std::int64_t first, std::int64_t end,
            std::vector<std::int32_t>& labels) {
    std::vector<float> least(static_cast<std::size_t>(end - first), std::numeric_limits<float>::infinity());
    const auto block = trajectories.middleCols(3 * first, 3 * (end - first));
    ColMajorMatrixXf rest;
    for (std::size_t i = 0; i < bases.size(); ++i) {
        if (members[i].empty()) continue;
        rest = block;
        if (bases[i].cols() > 0) {
            const ColMajorMatrixXf projected = bases[i].transpose() * block;
            rest.noalias() -= bases[i] * projected;
        }
        for (std::int64_t v = first; v < end; ++v) {
            const float left = rest.middleCols(3 * (v - first), 3).squaredNorm();
            float& best = least[static_cast<std::size_t>(v - first)];
            if (left < best) {
                best = left;
                labels[static_cast<std::size_t>(v)] = static_cast<std::int32_t>(i);
            }
        }
    }
}

}  // namespace

Expected<TrajectoryClusters> TrajectoryClusters::of(PositionsView positions,
                                                    std::span<const std::int32_t> labels,
                                                    std::int32_t cluster_count, std::int64_t components,
                                                    const Executor& executor) {
    const ColMajorMatrixXf trajectories = trajectories_of(positions, executor);
    TrajectoryClusters clusters;
    clusters.labels.assign(labels.begin(), labels.end());
    for (int round = 0; round < kMostRounds && cluster_count > 1; ++round) {
        const auto members = members_of(clusters.labels, cluster_count);
        std::vector<ColMajorMatrixXf> bases(members.size());
        const auto done = for_each_cluster(cluster_count, executor, [&](std::size_t i) -> Expected<void> {
            auto basis = principal_components(columns_of(trajectories, members[i]), components);
            if (!basis) return tl::unexpected(basis.error());
            bases[i] = std::move(*basis);
            return {};
        });
        if (!done) return tl::unexpected(done.error());
        const std::vector<std::int32_t> before = clusters.labels;
        executor.for_each(
            (positions.vertex_count() + kVerticesAtOnce - 1) / kVerticesAtOnce, [&](std::int64_t block) {
                const std::int64_t first = block * kVerticesAtOnce;
                assign(trajectories, bases, members, first,
                       std::min(first + kVerticesAtOnce, positions.vertex_count()), clusters.labels);
            });
        if (clusters.labels == before) break;
    }
    // Clusters that have vertices, by their numbers.
    const auto members = members_of(clusters.labels, cluster_count);
    for (std::size_t i = 0; i < members.size(); ++i) {
        if (members[i].empty()) continue;
        for (const std::int32_t v : members[i]) clusters.labels[static_cast<std::size_t>(v)] = clusters.count;
        ++clusters.count;
    }
    return clusters;
}

}  // namespace batchenc
