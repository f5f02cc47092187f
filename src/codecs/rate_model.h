#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdlib>

#include "codecs/level_rows.h"

namespace batchenc {

// Contexts by the magnitude that an integer is expected to have, and what it is thought to cost.

/// Classes of expected magnitudes: two an octave from a 32nd up to 64.
inline constexpr std::size_t kSizeClasses = 24;

/// RowContexts' class of an expected magnitude in 512ths, of any size.
inline std::uint32_t expectation_class(std::int64_t expected) {
    return RowContexts::class_of(static_cast<std::int32_t>(std::clamp<std::int64_t>(expected, 0, 1 << 25)));
}

/// Class of an expected magnitude in 512ths, 0 … kSizeClasses - 1.
inline std::size_t size_class(std::int64_t expected) {
    constexpr std::size_t kSmallest = 9;  // what is below is of the first class
    const std::size_t c = expectation_class(expected);
    return c < kSmallest ? 0 : std::min(c - kSmallest + 1, kSizeClasses - 1);
}

/// Magnitude for expectations, at most 2^16.
inline std::int32_t bounded_magnitude(std::int32_t value) {
    constexpr std::int32_t kLargest = 1 << 16;
    return value < -kLargest || value > kLargest ? kLargest : std::abs(value);
}

/// Squared error, in steps, that one bit is worth: at high rates an entropy-coded uniform quantiser of step 1
/// trades 2 ln 2 / 12 of it for a bit.
inline constexpr float kErrorPerBit = 0.1155f;

/// What integers are thought to cost, for choices of encoders.
class RateModel {
 public:
    /// The same where integers are rounded one by one: less, as what is coded after one is predicted from it
    /// (measured: 1 % fewer bits at equal error).
    static constexpr float kRoundingErrorPerBit = 0.08f;

    static const RateModel& get() {
        static const RateModel model;
        return model;
    }

    /// Of an integer of this magnitude where its expectation is of a class (expectation_class): as if
    /// distributed geometrically; but the number of digits bounds what a surprise costs.
    float bits(std::uint32_t size_class, std::int32_t magnitude) const {
        constexpr float kSurprise = 5.0f, kPerDigit = 1.5f;
        const float geometric = costs_(size_class, magnitude);
        if (geometric <= kSurprise + kPerDigit) return geometric;
        const auto digits = static_cast<float>(std::bit_width(static_cast<std::uint32_t>(magnitude)));
        return std::min(geometric, kSurprise + kPerDigit * digits);
    }

    struct Choice {
        std::int32_t value;
        float cost;  ///< squared error in steps, and what the bits are worth
    };
    /// The integer nearest to `target`, or the one beside it towards the prediction, whichever costs less.
    /// target: in steps, |target| below 2^30. size_class: expectation_class.
    Choice choose(float target, std::int32_t predicted, std::uint32_t size_class) const {
        const float nearest = std::floor(target + 0.5f);
        const auto first = static_cast<std::int32_t>(nearest);
        const Choice plain = {first, cost_of(target, first, predicted, size_class)};
        if (first == predicted) return plain;
        const std::int32_t second = first > predicted ? first - 1 : first + 1;
        const Choice nearer = {second, cost_of(target, second, predicted, size_class)};
        return nearer.cost < plain.cost ? nearer : plain;
    }

 private:
    RateModel() : costs_(LevelCosts::get()) {}
    float cost_of(float target, std::int32_t value, std::int32_t predicted, std::uint32_t size_class) const {
        const float error = target - static_cast<float>(value);
        return error * error + kRoundingErrorPerBit * bits(size_class, std::abs(value - predicted));
    }

    const LevelCosts& costs_;
};

}  // namespace batchenc
