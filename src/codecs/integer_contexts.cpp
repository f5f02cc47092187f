#include "codecs/integer_contexts.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "kernels/predecessor_prediction.h"

namespace batchenc {
namespace {

// What predict_from_predecessors wants: zeros behind a column, and levels within its bound (they have 20
// bits).
constexpr std::size_t kPadding = 4;

enum Predictor : std::int32_t { kPlain = 0, kMeanOfPredecessors = 1 };

/// A model of each class before it has learnt anything. Made once: copying one is much cheaper.
const IntegerModel& prior_of_class(int c) {
    static const std::vector<IntegerModel> priors = [] {
        std::vector<IntegerModel> made;
        for (int k = 0; k < ScaleContexts::kClasses; ++k) {
            // Powers of the square root of two by exact doubling, so that both sides start alike.
            made.emplace_back(std::ldexp(k % 2 == 0 ? 1.0 : 1.4142135623730951, k / 2 - 4));
        }
        return made;
    }();
    return priors[static_cast<std::size_t>(c)];
}

void encode_class(RangeEncoder& encoder, ScaleContexts& contexts, int scale_class) {
    encoder.encode(contexts.class_change, scale_class - contexts.last_class);
    contexts.last_class = scale_class;
}

int decode_class(RangeDecoder& decoder, ScaleContexts& contexts) {
    const std::int32_t change = decoder.decode(contexts.class_change);
    contexts.last_class =
        std::clamp(wrapping_sum(contexts.last_class, change), 0, ScaleContexts::kClasses - 1);
    return contexts.last_class;
}

/// Weighted sum of the values before t, rounded; see encode_fitted.
std::int32_t predict_fitted(std::span<const std::int32_t> series, std::size_t t,
                            std::span<const float> weights) {
    if (t < weights.size()) return t == 0 ? 0 : series[t - 1];
    double sum = 0.0;
    for (std::size_t k = 0; k < weights.size(); ++k)
        sum += static_cast<double>(weights[k]) * static_cast<double>(series[t - 1 - k]);
    constexpr double kLargest = 1 << 30;  // beyond it only corrupt streams are
    return static_cast<std::int32_t>(std::clamp(std::floor(sum + 0.5), -kLargest, kLargest));
}

}  // namespace

int ScaleContexts::class_of(double mean_magnitude) {
    if (!(mean_magnitude > 0.0625)) return 0;
    return std::clamp(static_cast<int>(std::lround(2.0 * std::log2(mean_magnitude))) + 8, 0, kClasses - 1);
}

IntegerModel& ScaleContexts::make(std::size_t scale_class) {
    models_[scale_class] = std::make_unique<IntegerModel>(prior_of_class(static_cast<int>(scale_class)));
    return *models_[scale_class];
}

void encode_series(RangeEncoder& encoder, SeriesContexts& contexts, std::span<const std::int32_t> series,
                   int most_order) {
    const TemporalChoice choice = choose_temporal_order(series, most_order);
    const int scale_class = ScaleContexts::class_of(choice.mean_magnitude);
    encoder.encode(contexts.scales.choice, choice.order);
    encode_class(encoder, contexts.scales, scale_class);
    IntegerModel& model = contexts.scales.of(scale_class);
    const auto count = static_cast<std::int64_t>(series.size());
    for (std::int64_t t = 0; t < count; ++t) {
        IntegerModel& context = t < choice.order ? contexts.starts[static_cast<std::size_t>(t)] : model;
        encoder.encode(
            context, series[static_cast<std::size_t>(t)] - predict_temporal(series.data(), t, choice.order));
    }
}

bool decode_series(RangeDecoder& decoder, SeriesContexts& contexts, std::span<std::int32_t> series) {
    const std::int32_t order = decoder.decode(contexts.scales.choice);
    if (order < 0 || order > kMaxTemporalOrder) return false;
    IntegerModel& model = contexts.scales.of(decode_class(decoder, contexts.scales));
    const auto count = static_cast<std::int64_t>(series.size());
    for (std::int64_t t = 0; t < count; ++t) {
        IntegerModel& context = t < order ? contexts.starts[static_cast<std::size_t>(t)] : model;
        series[static_cast<std::size_t>(t)] =
            wrapping_sum(predict_temporal(series.data(), t, order), decoder.decode(context));
    }
    return true;
}

std::vector<float> fit_weights(std::span<const std::int32_t> series, int order) {
    // Sums over t of x_{t-a} x_{t-b}.
    std::array<std::array<double, 3>, 3> sums{};
    for (std::size_t t = static_cast<std::size_t>(order); t < series.size(); ++t) {
        for (std::size_t a = 0; a <= static_cast<std::size_t>(order); ++a) {
            for (std::size_t b = 0; b <= a; ++b)
                sums[a][b] += static_cast<double>(series[t - a]) * static_cast<double>(series[t - b]);
        }
    }
    const double first = sums[1][1] > 0.0 ? sums[1][0] / sums[1][1] : 0.0;
    if (order == 1) return {static_cast<float>(first)};
    const double determinant = sums[1][1] * sums[2][2] - sums[2][1] * sums[2][1];
    if (!(determinant > 1e-9 * sums[1][1] * sums[2][2])) return {static_cast<float>(first), 0.0f};
    return {static_cast<float>((sums[1][0] * sums[2][2] - sums[2][0] * sums[2][1]) / determinant),
            static_cast<float>((sums[2][0] * sums[1][1] - sums[1][0] * sums[2][1]) / determinant)};
}

void encode_fitted(RangeEncoder& encoder, SeriesContexts& contexts, std::span<const float> weights,
                   std::span<const std::int32_t> series) {
    std::vector<std::int32_t> residuals(series.size());
    std::int64_t sum = 0;
    for (std::size_t t = 0; t < series.size(); ++t) {
        residuals[t] = series[t] - predict_fitted(series, t, weights);
        if (t >= weights.size()) sum += std::abs(std::int64_t{residuals[t]});
    }
    const auto predicted = static_cast<double>(std::max(series.size(), weights.size() + 1) - weights.size());
    const int scale_class = ScaleContexts::class_of(static_cast<double>(sum) / predicted);
    encode_class(encoder, contexts.scales, scale_class);
    IntegerModel& model = contexts.scales.of(scale_class);
    for (std::size_t t = 0; t < series.size(); ++t)
        encoder.encode(t < weights.size() ? contexts.starts[t] : model, residuals[t]);
}

bool decode_fitted(RangeDecoder& decoder, SeriesContexts& contexts, std::span<const float> weights,
                   std::span<std::int32_t> series) {
    IntegerModel& model = contexts.scales.of(decode_class(decoder, contexts.scales));
    for (std::size_t t = 0; t < series.size(); ++t) {
        const std::int32_t residual = decoder.decode(t < weights.size() ? contexts.starts[t] : model);
        series[t] = wrapping_sum(predict_fitted(series, t, weights), residual);
    }
    return true;
}

void encode_column(RangeEncoder& encoder, ScaleContexts& contexts, const ClusterTraversal& traversal,
                   std::span<const std::int32_t> column) {
    const auto vertices = static_cast<std::size_t>(traversal.size());
    std::vector<std::int32_t> padded(column.begin(), column.end());
    padded.resize(column.size() + kPadding);
    std::vector<std::int32_t> residuals(column.size() + kPadding);
    std::int64_t plain = 0, predicted = 0;
    for (std::size_t v = 0; v < vertices; ++v) {
        std::int32_t* residual = residuals.data() + 3 * v;
        predict_from_predecessors(traversal, padded.data(), v, residual);
        for (std::size_t c = 0; c < 3; ++c) {
            const std::int32_t value = column[3 * v + c];
            residual[c] = value - residual[c];
            plain += std::abs(value);
            predicted += std::abs(residual[c]);
        }
    }
    const Predictor predictor = predicted < plain ? kMeanOfPredecessors : kPlain;
    const double mean_magnitude =
        static_cast<double>(std::min(plain, predicted)) / static_cast<double>(3 * vertices);
    const int scale_class = ScaleContexts::class_of(mean_magnitude);
    encoder.encode(contexts.choice, predictor);
    encode_class(encoder, contexts, scale_class);
    IntegerModel& model = contexts.of(scale_class);
    const std::int32_t* symbols = predictor == kPlain ? column.data() : residuals.data();
    for (std::size_t k = 0; k < 3 * vertices; ++k) encoder.encode(model, symbols[k]);
}

bool decode_column(RangeDecoder& shared_decoder, ScaleContexts& contexts, const ClusterTraversal& traversal,
                   std::vector<std::int32_t>& column) {
    const std::int32_t predictor = shared_decoder.decode(contexts.choice);
    if (predictor != kPlain && predictor != kMeanOfPredecessors) return false;
    IntegerModel& model = contexts.of(decode_class(shared_decoder, contexts));
    RangeDecoder decoder = shared_decoder;  // a local copy stays in registers
    const auto vertices = static_cast<std::size_t>(traversal.size());
    column.assign(3 * vertices + kPadding, 0);
    bool good = true;
    std::array<std::int32_t, 4> mean{};
    for (std::size_t v = 0; v < vertices; ++v) {
        if (predictor == kMeanOfPredecessors)
            predict_from_predecessors(traversal, column.data(), v, mean.data());
        for (std::size_t c = 0; c < 3; ++c) {
            std::int32_t value = wrapping_sum(mean[c], decoder.decode(model));
            if (value > kLargestPredictable || value < -kLargestPredictable) [[unlikely]] {
                good = false;
                value = 0;
            }
            column[3 * v + c] = value;
        }
    }
    shared_decoder = decoder;
    return good;
}

}  // namespace batchenc
