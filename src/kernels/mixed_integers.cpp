#include "kernels/mixed_integers.h"

#include <bit>

namespace batchenc {
namespace {

// Decisions, numbered.
constexpr std::size_t kIsNotZero = 0;
constexpr std::size_t kIsNegative = 1;
constexpr std::size_t kMoreDigits = 1;   // + digits so far, 1 … 30
constexpr std::size_t kFirstDigit = 30;  // + digits, 2 … 31

}  // namespace

MixedBits MixedIntegers::make_bits(std::initializer_list<std::size_t> context_counts) {
    std::array<std::size_t, MixedBits::kMostContexts> counts{};
    std::size_t used = 0;
    for (const std::size_t count : context_counts) counts[used++] = count * kNodes;
    return MixedBits(std::span<const std::size_t>(counts.data(), used), kNodes);
}

MixedIntegers::MixedIntegers(std::initializer_list<std::size_t> context_counts)
    : bits_(make_bits(context_counts)) {}

std::int32_t MixedIntegers::code(BitCoder& coder, std::int32_t value, std::span<const std::size_t> contexts) {
    std::array<std::size_t, MixedBits::kMostContexts> at;
    for (std::size_t i = 0; i < contexts.size(); ++i) at[i] = contexts[i] * kNodes;
    std::size_t last = 0;
    const auto decide = [&](bool bit, std::size_t node) {
        for (std::size_t i = 0; i < contexts.size(); ++i) at[i] += node - last;
        last = node;
        return bits_.code(coder, bit, std::span<const std::size_t>(at.data(), contexts.size()), node);
    };
    if (!decide(value != 0, kIsNotZero)) return 0;
    const bool negative = decide(value < 0, kIsNegative);
    const std::uint32_t magnitude =
        value < 0 ? 0u - static_cast<std::uint32_t>(value) : static_cast<std::uint32_t>(value);
    const auto wanted = static_cast<std::size_t>(std::bit_width(magnitude));
    std::size_t digits = 1;
    while (digits < kMostDigits && decide(wanted > digits, kMoreDigits + digits)) ++digits;
    std::uint32_t number = 1;
    for (std::size_t k = digits - 1; k-- > 0;) {
        const bool digit = ((magnitude >> k) & 1) != 0;
        bool coded;
        if (k + 2 == digits)
            coded = decide(digit, kFirstDigit + digits);
        else if (k + 3 == digits)
            coded = code_bit(coder, second_[digits][number & 1], digit);
        else
            coded = coder.code(digit, 1u << 15);
        number = 2 * number + (coded ? 1 : 0);
    }
    return negative ? -static_cast<std::int32_t>(number) : static_cast<std::int32_t>(number);
}

}  // namespace batchenc
