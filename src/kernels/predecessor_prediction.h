#pragma once

#include <cstddef>
#include <cstdint>

#include "core/matrix.h"
#include "kernels/cluster_traversal.h"

namespace batchenc {

/// Magnitude of what predict_from_predecessors takes, at most.
inline constexpr std::int32_t kLargestPredictable = std::int32_t{1} << 21;

/// Prediction of a vertex' three integers from those of its predecessors: their mean, rounded to nearest by
/// float32 products and sums that have the same result on every machine; zeros without predecessors.
///
/// column: three values a vertex in the traversal's order, at most kLargestPredictable in magnitude, followed
/// by four zeros: missing predecessors point there. position: of the vertex in the order. predicted: four
/// integers, of which the last means nothing.
inline void predict_from_predecessors(const ClusterTraversal& traversal, const std::int32_t* column,
                                      std::size_t position, std::int32_t* predicted) {
    static_assert(ClusterTraversal::kMaxPredecessors == 4);
    constexpr float kShare[] = {0.0f, 1.0f, 0.5f, 1.0f / 3.0f, 0.25f};
    constexpr float kRounder =
        12582912.0f;  // 1.5 * 2^23: adding it leaves a float of small magnitude no fraction
    using Integers = Eigen::Array<std::int32_t, 4, 1>;
    const std::int32_t* places = traversal.predecessors.data() + position * 4;
    const auto of = [&](int k) {
        return Eigen::Map<const Integers>(column + 3 * static_cast<std::ptrdiff_t>(places[k]));
    };
    const Integers sum = (of(0) + of(1)) + (of(2) + of(3));
    const Eigen::Array4f rounded =
        (sum.cast<float>() * kShare[traversal.predecessor_count[position]] + kRounder) - kRounder;
    Eigen::Map<Integers>{predicted} = rounded.cast<std::int32_t>();
}

}  // namespace batchenc
