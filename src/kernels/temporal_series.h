#pragma once

#include <cstdint>
#include <span>

namespace batchenc {

/// Prediction of a series of integers along time from its own past: orders 0 (nothing), 1 (the value before),
/// 2 (constant velocity) and 3 (constant acceleration). On integers, so that both sides agree to the last
/// bit.
inline constexpr int kMaxTemporalOrder = 3;

/// a + b, wrapping around, which only a corrupt stream makes it do.
inline std::int32_t wrapping_sum(std::int32_t a, std::int32_t b) {
    return static_cast<std::int32_t>(static_cast<std::uint32_t>(a) + static_cast<std::uint32_t>(b));
}

/// Predicted value at position t; past the start of the series the order is min(order, t). Wraps around on
/// overflow, which only a corrupt stream reaches.
inline std::int32_t predict_temporal(const std::int32_t* series, std::int64_t t, int order) {
    const auto past = [&](int k) { return static_cast<std::uint32_t>(series[t - k]); };
    std::uint32_t predicted = 0;
    switch (t < order ? static_cast<int>(t) : order) {
        case 0:
            break;
        case 1:
            predicted = past(1);
            break;
        case 2:
            predicted = 2 * past(1) - past(2);
            break;
        default:
            predicted = 3 * (past(1) - past(2)) + past(3);
            break;
    }
    return static_cast<std::int32_t>(predicted);
}

/// The order up to most_order whose residuals have the smallest sum of magnitudes, and that sum over the
/// positions from kMaxTemporalOrder on.
struct TemporalChoice {
    int order = 0;
    double mean_magnitude = 0.0;
};
TemporalChoice choose_temporal_order(std::span<const std::int32_t> series,
                                     int most_order = kMaxTemporalOrder);

}  // namespace batchenc
