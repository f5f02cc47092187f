#include "kernels/bounding_box.h"

namespace batchenc {

BoundingBox bounding_box(PositionsView positions) {
    // Many running values, so that the loop over floats vectorises although the coordinates alternate.
    constexpr std::size_t kLanes = 24;
    std::array<float, kLanes> low, high;
    const float* p = positions.data();
    const auto count = static_cast<std::size_t>(positions.value_count());
    for (std::size_t k = 0; k < kLanes; ++k) low[k] = high[k] = p[k % 3];
    std::size_t i = 0;
    for (; i + kLanes <= count; i += kLanes) {
        for (std::size_t k = 0; k < kLanes; ++k) {
            low[k] = std::min(low[k], p[i + k]);
            high[k] = std::max(high[k], p[i + k]);
        }
    }
    BoundingBox box;
    for (std::size_t k = 0; i + k < count; ++k) {  // kLanes is a multiple of three: coordinates stay aligned
        low[k] = std::min(low[k], p[i + k]);
        high[k] = std::max(high[k], p[i + k]);
    }
    for (std::size_t c = 0; c < 3; ++c) {
        box.low[c] = low[c];
        box.high[c] = high[c];
        for (std::size_t k = c; k < kLanes; k += 3) {
            box.low[c] = std::min(box.low[c], low[k]);
            box.high[c] = std::max(box.high[c], high[k]);
        }
    }
    return box;
}

}  // namespace batchenc
