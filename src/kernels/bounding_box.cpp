#include "kernels/bounding_box.h"

#include "core/matrix.h"

namespace batchenc {

BoundingBox bounding_box(PositionsView positions) {
    // 24 running values, a multiple of three and of every vector's width, so that the loop vectorises
    // although the coordinates alternate.
    constexpr int kLanes = 24;
    using Lanes = Eigen::Array<float, kLanes, 1>;
    const float* p = positions.data();
    const std::int64_t count = positions.value_count();
    Lanes low, high;
    for (int k = 0; k < kLanes; ++k) low[k] = high[k] = p[k % 3];
    std::int64_t i = 0;
    for (; i + kLanes <= count; i += kLanes) {
        const Lanes values = Eigen::Map<const Lanes>(p + i);
        low = low.min(values);
        high = high.max(values);
    }
    for (int k = 0; i + k < count; ++k) {
        low[k] = std::min(low[k], p[i + k]);
        high[k] = std::max(high[k], p[i + k]);
    }
    BoundingBox box;
    for (int c = 0; c < 3; ++c) {
        float& lowest = box.low[static_cast<std::size_t>(c)] = low[c];
        float& highest = box.high[static_cast<std::size_t>(c)] = high[c];
        for (int k = c; k < kLanes; k += 3) {
            lowest = std::min(lowest, low[k]);
            highest = std::max(highest, high[k]);
        }
    }
    return box;
}

}  // namespace batchenc
