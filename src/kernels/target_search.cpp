#include "kernels/target_search.h"

#include <algorithm>
#include <optional>

namespace batchenc {
namespace {

constexpr double kCloseEnough = 0.995;
constexpr double kAim = 0.999;  // of the target: a guess that lands a little below it ends the search
constexpr int kPatience = 2;  // trials without halving what is left, before it is halved without the estimate

/// The last place of [low, high) whose estimate is not above `most`; low where there is none.
std::int64_t last_estimated_within(std::int64_t low, std::int64_t high, double most,
                                   const EstimateValue& estimate) {
    while (high - low > 1) {
        const std::int64_t middle = low + (high - low) / 2;
        (estimate(middle) <= most ? low : high) = middle;
    }
    return low;
}

}  // namespace

Expected<std::int64_t> last_within(std::int64_t count, double target, const EstimateValue& estimate,
                                   const MeasureValue& measure) {
    std::int64_t within = -1, above = count;
    std::optional<double> factor;  // of a value over its estimate
    std::int64_t width = count;    // of what was left when it had last been halved
    int slow = 0;                  // trials since
    std::int64_t guess = 0;
    for (int trial = 0; trial < kMostTrials && above - within > 1; ++trial) {
        const auto value = measure(guess);
        if (!value) return tl::unexpected(value.error());
        const bool is_within = *value <= target;
        (is_within ? within : above) = guess;
        if (is_within && *value >= kCloseEnough * target) break;
        if (const double estimated = estimate(guess); estimated > 0.0 && *value > 0.0)
            factor = *value / estimated;

        slow = 2 * (above - within) <= width ? 0 : slow + 1;
        if (slow == 0) width = above - within;
        guess = factor && slow < kPatience
                    ? last_estimated_within(within + 1, above, kAim * target / *factor, estimate)
                    : within + (above - within) / 2;
        guess = std::clamp(guess, within + 1, std::max(within + 1, above - 1));
    }
    return within;
}

}  // namespace batchenc
