#include "kernels/quantizer.h"

#include <algorithm>
#include <cmath>

namespace batchenc {

MinMaxQuantizer MinMaxQuantizer::of(std::span<const float> values, int bits) {
    const auto [low, high] = std::minmax_element(values.begin(), values.end());
    const double step = (static_cast<double>(*high) - *low) / static_cast<double>(std::int32_t{1} << bits);
    return {*low, static_cast<float>(step)};
}

bool MinMaxQuantizer::holds(std::span<const float> values, int bits) const {
    const bool finite =
        std::all_of(values.begin(), values.end(), [](float value) { return std::isfinite(value); });
    if (!finite || !std::isfinite(step) || !std::isfinite(dequantize(std::int32_t{1} << bits))) return false;
    return step > 0.0f ||
           std::all_of(values.begin(), values.end(), [this](float value) { return value == low; });
}

std::int32_t MinMaxQuantizer::zero_level(int bits) const { return quantize(0.0f, bits); }

}  // namespace batchenc
