#pragma once

#include <cstdint>
#include <span>

namespace batchenc {

/// Index of the first NaN or infinity, or -1. As fast as memory when there is none.
std::int64_t first_non_finite(std::span<const float> values);

}  // namespace batchenc
