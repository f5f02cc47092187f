#pragma once

#include <cstdint>
#include <functional>

#include "core/error.h"

namespace batchenc {

/// What is known of the value at a place without measuring it: not decreasing over the places; right up to a
/// common factor, which is learnt from what is measured.
using EstimateValue = std::function<double(std::int64_t place)>;
/// The value itself, at the price of a trial.
using MeasureValue = std::function<Expected<double>(std::int64_t place)>;

/// Trials that last_within makes at most.
inline constexpr int kMostTrials = 11;

/// The last place of 0 … count - 1 whose value is not above the target, or one whose value is at most 0.5 %
/// below the target, or the best one that kMostTrials trials have found; -1 where already place 0 is above.
/// Place 0 is measured first. Whatever place is returned has been measured. Values that fall a little from
/// place to place do no harm but that a better place may be missed.
///
/// count: at least 1. Errors: those of measure, at the first one.
Expected<std::int64_t> last_within(std::int64_t count, double target, const EstimateValue& estimate,
                                   const MeasureValue& measure);

}  // namespace batchenc
