#include "kernels/trajectory_sum.h"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/trajectory_sum.cpp"
#include <hwy/foreach_target.h>  // compiles this file once for every instruction set
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace batchenc {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

void sum(const TrajectoryCluster& cluster, const float* HWY_RESTRICT weights,
         const float* HWY_RESTRICT origin, float* HWY_RESTRICT out) {
    const hn::CappedTag<float, 8> d;
    const auto lanes = static_cast<std::int64_t>(hn::Lanes(d));
    const std::int64_t fields = 3 + cluster.component_count;
    const auto vertex_count = static_cast<std::int64_t>(cluster.vertices.size());
    const float* block = cluster.fields;
    HWY_ALIGN float places[3 * kTrajectoryLanes];
    for (std::int64_t first = 0; first < vertex_count;
         first += kTrajectoryLanes, block += fields * kTrajectoryLanes) {
        for (std::int64_t lane = 0; lane < kTrajectoryLanes; lane += 2 * lanes) {  // two vectors at once
            auto x0 = hn::Set(d, origin[0]), y0 = hn::Set(d, origin[1]), z0 = hn::Set(d, origin[2]);
            auto x1 = x0, y1 = y0, z1 = z0;
            const float* values = block + lane;
            const float* w = weights;
            for (std::int64_t l = 0; l < fields; ++l, values += kTrajectoryLanes, w += 3) {
                const auto a = hn::LoadU(d, values), b = hn::LoadU(d, values + lanes);
                const auto wx = hn::Set(d, w[0]), wy = hn::Set(d, w[1]), wz = hn::Set(d, w[2]);
                x0 = hn::Add(x0, hn::Mul(a, wx));
                y0 = hn::Add(y0, hn::Mul(a, wy));
                z0 = hn::Add(z0, hn::Mul(a, wz));
                x1 = hn::Add(x1, hn::Mul(b, wx));
                y1 = hn::Add(y1, hn::Mul(b, wy));
                z1 = hn::Add(z1, hn::Mul(b, wz));
            }
            hn::StoreInterleaved3(x0, y0, z0, d, places + 3 * lane);
            hn::StoreInterleaved3(x1, y1, z1, d, places + 3 * (lane + lanes));
        }
        const std::int32_t* vertices = cluster.vertices.data() + first;
        const std::int64_t count = std::min(kTrajectoryLanes, vertex_count - first);
        for (std::int64_t k = 0; k < count; ++k) {
            float* p = out + 3 * static_cast<std::ptrdiff_t>(vertices[k]);
            p[0] = places[3 * k];
            p[1] = places[3 * k + 1];
            p[2] = places[3 * k + 2];
        }
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace batchenc
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace batchenc {
namespace {
HWY_EXPORT(sum);
}

void sum_trajectories(const TrajectoryCluster& cluster, const float* weights, const float* origin,
                      float* out) {
    HWY_DYNAMIC_DISPATCH(sum)(cluster, weights, origin, out);
}

}  // namespace batchenc
#endif  // HWY_ONCE
