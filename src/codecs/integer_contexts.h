#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "kernels/cluster_traversal.h"
#include "kernels/range_coder.h"
#include "kernels/temporal_series.h"

namespace batchenc {

/// Contexts by the size that integers are expected to have, told by a small class number that the stream
/// carries: class c stands for a mean magnitude of 2^((c - 8) / 2). Runs of similar size share what they have
/// learnt. One object a stream and side.
class ScaleContexts {
 public:
    static constexpr int kClasses = 56;

    /// Class of a mean magnitude; 0 for the smallest.
    static int class_of(double mean_magnitude);
    /// The same for a magnitude in sixteenths, at most 2^23, rounded otherwise: by integers alone, so that no
    /// machine takes another context.
    static int class_of_sixteenths(std::int64_t size) {
        const auto s = static_cast<std::uint64_t>(std::clamp<std::int64_t>(size, 0, 1 << 23));
        const std::uint64_t scaled = (s * s * 92682) >> 16;  // s² times the root of two
        return scaled == 0 ? 0 : 63 - __builtin_clzll(scaled);
    }
    /// Context of a class; a class outside the range, which only a corrupt stream names, is treated as the
    /// nearest.
    IntegerModel& of(int scale_class) {
        const auto c = static_cast<std::size_t>(scale_class < 0          ? 0
                                                : scale_class < kClasses ? scale_class
                                                                         : kClasses - 1);
        return models_[c] ? *models_[c] : make(c);
    }

    int last_class = 16;  ///< of the run before in this stream; classes are coded as differences
    IntegerModel class_change{2.0};
    IntegerModel choice{1.0};  ///< predictor or order of each run

 private:
    IntegerModel& make(std::size_t scale_class);

    std::array<std::unique_ptr<IntegerModel>, kClasses> models_;
};

/// Contexts of series along time.
struct SeriesContexts {
    ScaleContexts scales;
    std::array<IntegerModel, 3> starts = {IntegerModel(2000.0), IntegerModel(100.0),
                                          IntegerModel(30.0)};  ///< of the first values
};

/// Codes one series along time: the best prediction order up to most_order, the residuals' scale, the
/// residuals (see kernels/temporal_series.h).
void encode_series(RangeEncoder& encoder, SeriesContexts& contexts, std::span<const std::int32_t> series,
                   int most_order = kMaxTemporalOrder);
/// The way back; false when the stream is seen to be corrupt (the caller's finish() finds the rest).
bool decode_series(RangeDecoder& decoder, SeriesContexts& contexts, std::span<std::int32_t> series);

/// How series are predicted along time: by differences of the best order up to most_order, or, where fitted
/// is not 0, by a weighted sum of so many values before, whose weights are fitted to each series and sent.
struct SeriesForm {
    int most_order = kMaxTemporalOrder;
    int fitted = 0;

    /// Those of series `index` among weights of many.
    std::span<const float> weights_of(const std::vector<float>& weights, std::int64_t index) const {
        const auto count = static_cast<std::size_t>(fitted);
        return std::span(weights).subspan(static_cast<std::size_t>(index) * count, count);
    }
};

/// Weights w for which the sum of (x_t - w_1 x_{t-1} - … - w_order x_{t-order})² is smallest. order: 1 or 2.
std::vector<float> fit_weights(std::span<const std::int32_t> series, int order);
/// Codes one series, each value against the weighted sum of those before it, rounded; the first not
/// predicted, those without enough before them against the one before. The arithmetic is double precision's
/// in a fixed order. weights: finite. series: at most 2^20 in magnitude.
void encode_fitted(RangeEncoder& encoder, SeriesContexts& contexts, std::span<const float> weights,
                   std::span<const std::int32_t> series);
/// The way back; a corrupt stream gives some values.
bool decode_fitted(RangeDecoder& decoder, SeriesContexts& contexts, std::span<const float> weights,
                   std::span<std::int32_t> series);

/// Codes one column of a basis, three values a vertex in the traversal's order: plain, or each value against
/// the mean of its predecessors over the mesh, whichever is smaller. column: 3n levels, at most 2^20 in
/// magnitude.
void encode_column(RangeEncoder& encoder, ScaleContexts& contexts, const ClusterTraversal& traversal,
                   std::span<const std::int32_t> column);
/// The way back. column: resized to hold the 3n levels first; what stands behind them means nothing. False
/// when the stream is seen to be corrupt.
bool decode_column(RangeDecoder& decoder, ScaleContexts& contexts, const ClusterTraversal& traversal,
                   std::vector<std::int32_t>& column);

}  // namespace batchenc
