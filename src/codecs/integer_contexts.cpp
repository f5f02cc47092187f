#include "codecs/integer_contexts.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "kernels/temporal_series.h"

namespace batchenc {
namespace {

std::int32_t wrapping_sum(std::int32_t a, std::int32_t b) {
    return static_cast<std::int32_t>(static_cast<std::uint32_t>(a) + static_cast<std::uint32_t>(b));
}

/// Mean of the predecessors' three values; both sides call it.
std::array<std::int32_t, 3> predict_vertex(const ClusterTraversal& traversal, const std::int32_t* column,
                                           std::size_t vertex) {
    const std::int32_t* predecessors =
        traversal.predecessors.data() + vertex * ClusterTraversal::kMaxPredecessors;
    const int count = traversal.predecessor_count[vertex];
    std::array<std::int32_t, 3> sum{};
    for (int k = 0; k < count; ++k) {
        for (std::size_t c = 0; c < 3; ++c)
            sum[c] = wrapping_sum(sum[c], column[3 * static_cast<std::size_t>(predecessors[k]) + c]);
    }
    for (std::int32_t& s : sum) s = rounded_mean(s, count);
    return sum;
}

enum Predictor : std::int32_t { kPlain = 0, kMeanOfPredecessors = 1 };

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

}  // namespace

int ScaleContexts::class_of(double mean_magnitude) {
    if (!(mean_magnitude > 0.0625)) return 0;
    return std::clamp(static_cast<int>(std::lround(2.0 * std::log2(mean_magnitude))) + 8, 0, kClasses - 1);
}

IntegerModel& ScaleContexts::of(int scale_class) {
    const int c = std::clamp(scale_class, 0, kClasses - 1);
    auto& model = models_[static_cast<std::size_t>(c)];
    if (!model) {
        // Powers of the square root of two by exact doubling, so that both sides start alike.
        const double magnitude = std::ldexp(c % 2 == 0 ? 1.0 : 1.4142135623730951, c / 2 - 4);
        model = std::make_unique<IntegerModel>(magnitude);
    }
    return *model;
}

void encode_series(RangeEncoder& encoder, SeriesContexts& contexts, std::span<const std::int32_t> series) {
    const TemporalChoice choice = choose_temporal_order(series);
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

void encode_column(RangeEncoder& encoder, ScaleContexts& contexts, const ClusterTraversal& traversal,
                   std::span<const std::int32_t> column) {
    const auto vertices = static_cast<std::size_t>(traversal.size());
    std::int64_t plain = 0, predicted = 0;
    for (std::size_t v = 0; v < vertices; ++v) {
        const auto mean = predict_vertex(traversal, column.data(), v);
        for (std::size_t c = 0; c < 3; ++c) {
            plain += std::abs(column[3 * v + c]);
            predicted += std::abs(column[3 * v + c] - mean[c]);
        }
    }
    const Predictor predictor = predicted < plain ? kMeanOfPredecessors : kPlain;
    const double mean_magnitude =
        static_cast<double>(std::min(plain, predicted)) / static_cast<double>(3 * vertices);
    const int scale_class = ScaleContexts::class_of(mean_magnitude);
    encoder.encode(contexts.choice, predictor);
    encode_class(encoder, contexts, scale_class);
    IntegerModel& model = contexts.of(scale_class);
    for (std::size_t v = 0; v < vertices; ++v) {
        const auto mean =
            predictor == kPlain ? std::array<std::int32_t, 3>{} : predict_vertex(traversal, column.data(), v);
        for (std::size_t c = 0; c < 3; ++c) encoder.encode(model, column[3 * v + c] - mean[c]);
    }
}

bool decode_column(RangeDecoder& shared_decoder, ScaleContexts& contexts, const ClusterTraversal& traversal,
                   std::span<std::int32_t> column) {
    const std::int32_t predictor = shared_decoder.decode(contexts.choice);
    if (predictor != kPlain && predictor != kMeanOfPredecessors) return false;
    IntegerModel& model = contexts.of(decode_class(shared_decoder, contexts));
    RangeDecoder decoder = shared_decoder;  // a local copy stays in registers
    if (predictor == kPlain) {
        for (std::int32_t& value : column) value = decoder.decode(model);
    } else {
        for (std::size_t v = 0; v < static_cast<std::size_t>(traversal.size()); ++v) {
            const auto mean = predict_vertex(traversal, column.data(), v);
            for (std::size_t c = 0; c < 3; ++c)
                column[3 * v + c] = wrapping_sum(mean[c], decoder.decode(model));
        }
    }
    shared_decoder = decoder;
    return true;
}

}  // namespace batchenc
