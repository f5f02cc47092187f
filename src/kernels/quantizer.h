#pragma once

#include <cstdint>
#include <span>

namespace batchenc {

/// Uniform quantiser over the range of a matrix' values (6.3.5): level = round((value - low) / step), 0 …
/// 2^bits. Decoding depends on low and step alone, which the bitstream carries as float32.
struct MinMaxQuantizer {
    float low = 0.0f;
    float step = 0.0f;  ///< 0 where all values are equal; every level then means low

    /// values: at least one, finite. bits: 2 … 24.
    static MinMaxQuantizer of(std::span<const float> values, int bits);

    /// Whether float32 carries the whole scale: no end of it overflows, and the step of a range that is not
    /// empty is not lost. values: those that the quantiser was made of; all finite, or the answer is no.
    bool holds(std::span<const float> values, int bits) const;

    /// Level that stands for zero, or the end of the scale that is nearest to it. Levels are coded relative
    /// to it, so that values around zero become small integers.
    std::int32_t zero_level(int bits) const;

    std::int32_t quantize(float value, int bits) const {
        if (step == 0.0f) return 0;
        const double top = static_cast<double>(std::int32_t{1} << bits);
        const double level = (static_cast<double>(value) - low) / step + 0.5;
        return static_cast<std::int32_t>(level < 0.0   ? 0.0
                                         : level > top ? top
                                                       : level);  // truncation is floor here
    }
    float dequantize(std::int32_t level) const { return low + static_cast<float>(level) * step; }
};

}  // namespace batchenc
