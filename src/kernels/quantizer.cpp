#include "kernels/quantizer.h"

#include <algorithm>

namespace batchenc {

MinMaxQuantizer MinMaxQuantizer::of(std::span<const float> values, int bits) {
    const auto [low, high] = std::minmax_element(values.begin(), values.end());
    const double step = (static_cast<double>(*high) - *low) / static_cast<double>(std::int32_t{1} << bits);
    return {*low, static_cast<float>(step)};
}

std::int32_t MinMaxQuantizer::zero_level(int bits) const { return quantize(0.0f, bits); }

}  // namespace batchenc
