#include "kernels/temporal_series.h"

#include <array>
#include <cstdlib>

namespace batchenc {

TemporalChoice choose_temporal_order(std::span<const std::int32_t> series, int most_order) {
    std::array<std::int64_t, kMaxTemporalOrder + 1> sums{};
    const auto count = static_cast<std::int64_t>(series.size());
    for (std::int64_t t = kMaxTemporalOrder; t < count; ++t) {
        const std::int32_t* x = series.data() + t;
        sums[0] += std::abs(x[0]);
        sums[1] += std::abs(x[0] - x[-1]);
        sums[2] += std::abs(x[0] - (2 * x[-1] - x[-2]));
        sums[3] += std::abs(x[0] - (3 * (x[-1] - x[-2]) + x[-3]));
    }
    TemporalChoice choice;
    for (int order = 1; order <= most_order; ++order) {
        if (sums[static_cast<std::size_t>(order)] < sums[static_cast<std::size_t>(choice.order)])
            choice.order = order;
    }
    if (count > kMaxTemporalOrder) {
        choice.mean_magnitude = static_cast<double>(sums[static_cast<std::size_t>(choice.order)]) /
                                static_cast<double>(count - kMaxTemporalOrder);
    }
    return choice;
}

}  // namespace batchenc
