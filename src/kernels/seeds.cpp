#include "kernels/seeds.h"

#include <algorithm>
#include <limits>

#include "core/matrix.h"

namespace batchenc {

std::vector<std::int32_t> farthest_point_seeds(PositionsView frame, std::int32_t count) {
    const std::int64_t vertex_count = frame.vertex_count();
    const Eigen::Map<const ColMajorMatrix3Xf> points(frame.at(0, 0), 3, vertex_count);
    const auto centroid = points.cast<double>().rowwise().mean().eval();
    std::vector<double> distance(static_cast<std::size_t>(vertex_count));
    for (std::int64_t v = 0; v < vertex_count; ++v) {
        distance[static_cast<std::size_t>(v)] = (points.col(v).cast<double>() - centroid).squaredNorm();
    }
    std::vector<std::int32_t> seeds;
    const auto farthest = [&] {
        return static_cast<std::int32_t>(std::max_element(distance.begin(), distance.end()) -
                                         distance.begin());
    };
    seeds.push_back(farthest());
    std::fill(distance.begin(), distance.end(), std::numeric_limits<double>::infinity());
    while (static_cast<std::int32_t>(seeds.size()) < count) {
        const float* last = frame.at(0, seeds.back());
        for (std::int64_t v = 0; v < vertex_count; ++v) {
            double& d = distance[static_cast<std::size_t>(v)];
            d = std::min(d, squared_distance(frame.at(0, v), last));
        }
        const std::int32_t next = farthest();
        if (!(distance[static_cast<std::size_t>(next)] > 0.0)) break;  // every vertex sits on a seed
        seeds.push_back(next);
    }
    return seeds;
}

}  // namespace batchenc
