#include "codecs/field_coder.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "codecs/rate_model.h"

namespace batchenc {
namespace {

// Counts of what contexts tell apart.
constexpr std::size_t kFractions = 8;  // of the prediction, eighths
constexpr std::size_t kSides = 9;      // classes of a signed difference
constexpr std::size_t kRanks = 8;      // of the field
constexpr std::size_t kNeighbourhoods = 5;

/// Class of a difference in eighths, sign and size.
std::size_t side_class(std::int64_t difference) {
    const std::int64_t size = std::abs(difference);
    const std::size_t c = size < 2 ? 0 : size < 6 ? 1 : size < 16 ? 2 : size < 64 ? 3 : 4;
    return difference < 0 ? 4 - c : 4 + c;
}

std::int64_t rounded_quotient(std::int64_t value, std::int64_t divisor) {  // to nearest, halves up
    const std::int64_t doubled = 2 * value + divisor;
    const std::int64_t quotient = doubled / (2 * divisor);
    return quotient - (doubled % (2 * divisor) < 0 ? 1 : 0);
}

/// What is known of a value before it is coded.
struct Guess {
    std::int64_t parallelogram = 0;  // in eighths; the neighbours' mean where there is none
    std::int64_t mean = 0;           // of the neighbours, in eighths
    std::int64_t near_size = 0;      // mean magnitude of the neighbours' residuals, in 512ths
    std::int64_t near_sum = 0;       // sum of their residuals, in eighths of their mean
    std::size_t neighbours = 0;
    bool has_parallelogram = false;

    std::int64_t eighths(FieldPredictor predictor) const {
        switch (predictor) {
            case FieldPredictor::kParallelogram:
                return parallelogram;
            case FieldPredictor::kBlend:
                return (parallelogram + mean) >> 1;
            case FieldPredictor::kMean:
                return mean;
            case FieldPredictor::kHalf:
                return mean >> 1;
            case FieldPredictor::kNone:
                break;
        }
        return 0;
    }
};

Guess guess_at(const FieldOrder& order, std::size_t place, const std::int32_t* values,
               const std::int32_t* residuals) {
    Guess guess;
    std::int64_t sum = 0, sizes = 0, signed_sum = 0;
    const std::int32_t first = order.first_neighbour[place], end = order.first_neighbour[place + 1];
    for (std::int32_t k = first; k < end; ++k) {
        const auto at = static_cast<std::size_t>(order.neighbours[static_cast<std::size_t>(k)]);
        sum += values[at];
        sizes += bounded_magnitude(residuals[at]);
        signed_sum += residuals[at];
    }
    guess.neighbours = static_cast<std::size_t>(end - first);
    if (guess.neighbours > 0) {
        guess.mean = rounded_quotient(8 * sum, end - first);
        guess.near_size = 512 * sizes / (end - first);
        guess.near_sum = rounded_quotient(8 * signed_sum, end - first);
    }
    const std::int32_t first_gate = order.first_gate[place], end_gate = order.first_gate[place + 1];
    guess.has_parallelogram = end_gate > first_gate;
    guess.parallelogram = guess.mean;
    if (guess.has_parallelogram) {
        std::int64_t total = 0;
        for (std::int32_t k = first_gate; k < end_gate; ++k) {
            const auto& [left, right, opposite] = order.gates[static_cast<std::size_t>(k)];
            total += std::int64_t{values[left]} + values[right] - values[opposite];
        }
        guess.parallelogram = rounded_quotient(8 * total, end_gate - first_gate);
    }
    return guess;
}

/// Expected magnitude of a residual in 512ths, from the neighbours' and from earlier fields.
std::int64_t expected_size(const Guess& guess, std::int32_t memory) {
    const std::int64_t past = 32 * std::int64_t{memory};
    return guess.neighbours == 0 ? past : (3 * guess.near_size + past) >> 2;
}

std::int32_t clamp_to_value(std::int64_t value) {
    return static_cast<std::int32_t>(
        std::clamp<std::int64_t>(value, -2 * std::int64_t{kLargestFieldValue}, 2 * kLargestFieldValue));
}

}  // namespace

FieldCoder::FieldCoder()
    : integers_{kSizeClasses * kFractions, kSizeClasses * kSides, kSizeClasses * kSizeClasses,
                kNeighbourhoods * kRanks * kSizeClasses, kSides * kFractions} {}

FieldPredictor FieldCoder::code(BitCoder& coder, const FieldOrder& order, FieldMemory& memory,
                                FieldPredictor predictor, std::span<std::int32_t> values) {
    predictor = static_cast<FieldPredictor>(std::min<std::size_t>(
        predictors_.code(coder, static_cast<std::uint32_t>(predictor)), kFieldPredictors - 1));
    const std::size_t rank = std::min<std::size_t>(static_cast<std::size_t>(memory.fields), kRanks - 1);
    residuals_.assign(values.size(), 0);
    for (std::size_t k = 0; k < values.size(); ++k) {
        const Guess guess = guess_at(order, k, values.data(), residuals_.data());
        const std::int64_t eighths = guess.eighths(predictor);
        const std::int64_t center = (eighths + 4) >> 3;
        const auto fraction = static_cast<std::size_t>(eighths - 8 * center + 4);
        const std::size_t near = size_class(guess.near_size);
        const std::size_t past = size_class(32 * std::int64_t{memory.sizes[k]});
        const std::size_t both = size_class(expected_size(guess, memory.sizes[k]));
        const std::int64_t other = predictor >= FieldPredictor::kMean ? guess.parallelogram : guess.mean;
        const std::size_t neighbourhood =
            std::min<std::size_t>(guess.neighbours, 3) + guess.has_parallelogram;
        const std::array<std::size_t, 5> contexts = {
            both * kFractions + fraction, near * kSides + side_class(other - eighths),
            past * kSizeClasses + near, (neighbourhood * kRanks + rank) * kSizeClasses + both,
            side_class(guess.near_sum) * kFractions + fraction};
        const std::int64_t wanted = std::int64_t{values[k]} - center;
        const std::int32_t residual = integers_.code(coder, clamp_to_value(wanted), contexts);
        residuals_[k] = residual;
        values[k] = clamp_to_value(center + residual);
        memory.sizes[k] += (16 * bounded_magnitude(residual) - memory.sizes[k] + 1) >> 1;
    }
    ++memory.fields;
    return predictor;
}

FieldPredictor quantize_field(const FieldOrder& order, std::span<const float> targets,
                              std::span<std::int32_t> values) {
    const RateModel& rates = RateModel::get();
    std::vector<std::int32_t> tried(values.size()), residuals(values.size());
    FieldPredictor best = FieldPredictor::kNone;
    float least = std::numeric_limits<float>::infinity();
    for (std::size_t p = 0; p < kFieldPredictors; ++p) {
        const auto predictor = static_cast<FieldPredictor>(p);
        float cost = 0.0f;
        for (std::size_t k = 0; k < values.size(); ++k) {
            const Guess guess = guess_at(order, k, tried.data(), residuals.data());
            const std::int64_t center = (guess.eighths(predictor) + 4) >> 3;
            const std::uint32_t size = expectation_class(guess.neighbours == 0 ? 512 : 16 + guess.near_size);
            const RateModel::Choice choice =
                rates.choose(targets[k], static_cast<std::int32_t>(center), size);
            tried[k] = choice.value;
            residuals[k] = choice.value - static_cast<std::int32_t>(center);
            cost += choice.cost;
        }
        if (cost < least) {
            least = cost;
            best = predictor;
            std::copy(tried.begin(), tried.end(), values.begin());
        }
    }
    return best;
}

}  // namespace batchenc
