#pragma once

#include <vector>

#include "codecs/rlpca_layout.h"
#include "core/matrix.h"
#include "kernels/rate_allocation.h"

namespace batchenc {

/// What is to be expected of a cluster when its first l components are coded, l = 0 … L: a quantiser's range,
/// and with it its step, is that of exactly these components.
struct ComponentModel {
    std::vector<double> errors;             ///< squared: what the components miss, and what quantisers add
    std::vector<double> basis_steps;        ///< 0 for none
    std::vector<double> coefficient_steps;  ///< likewise

    /// matrix: 3n × F. components: its singular vectors, 3n × L, exact. header: for the bits.
    static ComponentModel of(const ColMajorMatrixXf& matrix, const ColMajorMatrixXf& components,
                             const RlpcaHeader& header);

    /// Points of 0 … L components with their bits as rates. component_bits: of each of the L when all of them
    /// are coded; finer steps then cost more bits a value, n × 3 and F values a component.
    std::vector<RatePoint> points_by_bits(const std::vector<double>& component_bits, std::int64_t rows,
                                          std::int64_t frames) const;
    /// Likewise with the numbers that they consist of as rates.
    std::vector<RatePoint> points_by_numbers(std::int64_t rows, std::int64_t frames) const;
};

}  // namespace batchenc
