#pragma once

#include <bit>
#include <cstdint>
#include <limits>

namespace batchenc {

// A vertex whose residuals would not keep the bound is coded exactly: a mark in place of its first residual,
// then its coordinates bit by bit.

/// The mark.
inline constexpr std::int32_t kExact = std::numeric_limits<std::int32_t>::min();

/// A float as the integer that is coded, and back.
inline std::int32_t bits_of(float value) {
    return static_cast<std::int32_t>(std::bit_cast<std::uint32_t>(value));
}
inline float float_of(std::int32_t bits) { return std::bit_cast<float>(static_cast<std::uint32_t>(bits)); }

}  // namespace batchenc
