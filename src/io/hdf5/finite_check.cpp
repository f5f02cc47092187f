#include "io/hdf5/finite_check.h"

#include <algorithm>
#include <bit>

namespace batchenc {

namespace {

bool all_finite(const float* values, std::int64_t count) {
    // An exponent of all ones is NaN or Inf. An integer comparison and an OR: no branch and no floating-point
    // order, so that the compiler makes a vector loop of it.
    std::uint32_t bad = 0;
    for (std::int64_t i = 0; i < count; ++i)
        bad |=
            static_cast<std::uint32_t>((std::bit_cast<std::int32_t>(values[i]) & 0x7fffffff) >= 0x7f800000);
    return bad == 0;
}

}  // namespace

std::int64_t first_non_finite(std::span<const float> values) {
    constexpr std::int64_t kBlock = 4096;
    const auto count = static_cast<std::int64_t>(values.size());
    for (std::int64_t begin = 0; begin < count; begin += kBlock) {
        const std::int64_t end = std::min(begin + kBlock, count);
        if (all_finite(values.data() + begin, end - begin)) continue;
        for (std::int64_t i = begin; i < end; ++i)
            if (!all_finite(values.data() + i, 1)) return i;
    }
    return -1;
}

}  // namespace batchenc
