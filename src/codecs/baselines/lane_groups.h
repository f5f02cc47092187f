#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "core/executor.h"
#include "kernels/dct.h"

namespace batchenc {

/// Takes `signals` signals of `rows` samples kDctLanes at a time: load(row, signal) fills a buffer of rows of
/// kDctLanes floats, lanes without a signal with zeros, transform(buffer) changes it in place, and
/// store(row, signal, value) takes it away. Groups run at once.
template <typename Load, typename Transform, typename Store>
void transform_signals(std::int64_t rows, std::int64_t signals, const Executor& executor, Load load,
                       Transform transform, Store store) {
    executor.for_each((signals + kDctLanes - 1) / kDctLanes, [&](std::int64_t group) {
        const std::int64_t first = group * kDctLanes, count = std::min(kDctLanes, signals - first);
        std::vector<float> buffer(static_cast<std::size_t>(rows * kDctLanes));
        const auto at = [&](std::int64_t row, std::int64_t lane) -> float& {
            return buffer[static_cast<std::size_t>(row * kDctLanes + lane)];
        };
        for (std::int64_t row = 0; row < rows; ++row)
            for (std::int64_t lane = 0; lane < count; ++lane) at(row, lane) = load(row, first + lane);
        transform(buffer.data());
        for (std::int64_t row = 0; row < rows; ++row)
            for (std::int64_t lane = 0; lane < count; ++lane) store(row, first + lane, at(row, lane));
    });
}

/// What transforms of a clip may become, in steps, so that sums of three stay integers of 32 bits.
inline constexpr double kLargestLevel = 1 << 29;

/// The level nearest to a value; beyond kLargestLevel (see is_codable) the end of the range, and for NaN too.
inline std::int32_t nearest_level(float value, double step) {
    if (!(step > 0.0)) return 0;
    const double level = std::floor(static_cast<double>(value) / step + 0.5);
    return static_cast<std::int32_t>(level > -kLargestLevel ? std::min(level, kLargestLevel)
                                                            : -kLargestLevel);
}

/// Whether no level had to be cut off.
inline bool is_codable(const std::vector<std::int32_t>& levels) {
    constexpr auto kLargest = static_cast<std::int32_t>(kLargestLevel);
    return std::all_of(levels.begin(), levels.end(),
                       [](std::int32_t level) { return level > -kLargest && level < kLargest; });
}

}  // namespace batchenc
