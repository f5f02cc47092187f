#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "kernels/bit_coder.h"
#include "kernels/field_order.h"
#include "kernels/mixed_integers.h"

namespace batchenc {

// Fields over the vertices of a cluster, one integer a vertex: coordinates of the mean shape, coefficients of
// a component. All arithmetic is of integers, so that both sides predict alike.

/// From what a value is predicted among those before it (see FieldOrder). The numbers stand in bitstreams.
enum class FieldPredictor : std::uint8_t {
    kParallelogram = 0,  ///< mean of the parallelograms
    kBlend = 1,          ///< half that and half the neighbours' mean
    kMean = 2,           ///< mean of the neighbours
    kHalf = 3,           ///< half of it
    kNone = 4,
};
inline constexpr std::size_t kFieldPredictors = 5;

/// Sizes of residuals at the vertices of one cluster, from field to field. One object a cluster and side.
struct FieldMemory {
    explicit FieldMemory(std::int64_t vertices) : sizes(static_cast<std::size_t>(vertices), 0) {}
    std::vector<std::int32_t> sizes;  ///< running mean of magnitudes, in sixteenths
    std::int32_t fields = 0;          ///< coded so far
};

/// The contexts of one stream of fields.
class FieldCoder {
 public:
    FieldCoder();

    /// Codes a field in either direction. order: n places. values: n integers, when encoding at most half of
    /// kLargestFieldValue in magnitude; overwritten when decoding. Returns the predictor, which is given when
    /// encoding. A corrupt stream gives some values.
    FieldPredictor code(BitCoder& coder, const FieldOrder& order, FieldMemory& memory,
                        FieldPredictor predictor, std::span<std::int32_t> values);

 private:
    AdaptiveNumber predictors_{kFieldPredictors - 1};
    MixedIntegers integers_;
    std::vector<std::int32_t> residuals_;
};

/// Magnitude of a value and of a sum of a few at most; decoders limit values to twice that.
inline constexpr std::int32_t kLargestFieldValue = std::int32_t{1} << 28;

/// Rounds a field to integers so that squared error and bits are least together, and chooses its predictor.
/// targets: n values in steps, at most half of kLargestFieldValue in magnitude. values: n integers,
/// overwritten.
FieldPredictor quantize_field(const FieldOrder& order, std::span<const float> targets,
                              std::span<std::int32_t> values);

}  // namespace batchenc
