#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <span>

#include "kernels/bit_coder.h"

namespace batchenc {

/// Signed integers of one kind, each coded under several contexts at once (see MixedBits): whether it is
/// zero, its sign, the number of its binary digits one by one, and its digits, of which the first two behind
/// the leading one are modelled. What is likely takes few decisions, and every integer has a place.
class MixedIntegers {
 public:
    /// Magnitude of an integer at most.
    static constexpr std::int32_t kLargest = std::int32_t{1} << 30;

    /// context_counts: how many values each of up to MixedBits::kMostContexts contexts takes.
    explicit MixedIntegers(std::initializer_list<std::size_t> context_counts);

    /// Codes in either direction, as BitCoder does. contexts: as many as there are counts, each below its
    /// count. A corrupt stream may give any integer but the least one.
    std::int32_t code(BitCoder& coder, std::int32_t value, std::span<const std::size_t> contexts);

 private:
    static constexpr std::size_t kNodes = 64;
    static constexpr std::size_t kMostDigits = 31;

    static MixedBits make_bits(std::initializer_list<std::size_t> context_counts);

    MixedBits bits_;
    std::array<std::array<AdaptiveBit, 2>, kMostDigits + 1> second_;  // second digit behind the leading one
};

}  // namespace batchenc
