#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace batchenc {

/// Vertices that the kernel takes at once.
inline constexpr std::int64_t kTrajectoryLanes = 16;

/// A cluster as the kernel needs it: fields of its vertices in blocks of kTrajectoryLanes, each block holding
/// the three coordinates of the mean shape and then the L coefficients, field by field; the last block filled
/// up with zeros.
struct TrajectoryCluster {
    std::span<const std::int32_t> vertices;  ///< n vertex indices, ascending
    const float* fields = nullptr;           ///< ceil(n / lanes) blocks of (3 + L) × lanes floats
    std::int64_t component_count = 0;        ///< L

    static std::size_t field_index(std::int64_t vertex, std::int64_t field, std::int64_t components) {
        return static_cast<std::size_t>((vertex / kTrajectoryLanes * (3 + components) + field) *
                                            kTrajectoryLanes +
                                        vertex % kTrajectoryLanes);
    }
};

/// Places of a cluster's vertices in one frame: p = sum over fields of field × weight, scattered to the
/// vertices' places. weights: (3 + L) × 3 floats, for each field what it adds to x, y and z (of the shape the
/// rotation, of a component the rotated basis); origin: three floats, added first. out: V × 3.
/// SIMD with run-time dispatch. Products are not fused and sums run in the order of the fields, so that every
/// CPU gives the same bits.
void sum_trajectories(const TrajectoryCluster& cluster, const float* weights, const float* origin,
                      float* out);

}  // namespace batchenc
