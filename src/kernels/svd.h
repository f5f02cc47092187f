#pragma once

#include <cstdint>

#include "core/error.h"
#include "core/matrix.h"

namespace batchenc {

/// Ways to the leading singular vectors of a tall or wide matrix; which one pays depends on its shape.
enum class SvdMethod {
    kDirect,  ///< dgesdd on the matrix itself: most accurate, slowest; for small matrices and as reference
    kGram,    ///< dsyevr on the smaller of AᵀA and AAᵀ in double precision
    kRandomized,  ///< randomised subspace iteration in float32 (Halko, Martinsson and Tropp 2011,
                  ///< algorithm 4.4)
};

/// The method that was measured to be fastest for the shape at the accuracy that coding needs.
SvdMethod choose_svd_method(std::int64_t rows, std::int64_t columns, std::int64_t rank);

/// Leading left singular vectors and singular values.
struct TruncatedSvd {
    ColMajorMatrixXf basis;           ///< rows × r, orthonormal columns, most important first
    Eigen::VectorXf singular_values;  ///< r values, not increasing, all above 0
};

/// Leading min(rank, numerical rank) left singular vectors of a matrix. Values below 1e-6 of the largest
/// count as zero (float32 input carries no more); a zero matrix has no vectors.
///
/// matrix: rows × columns, both at least 1. rank: at least 1.
/// Errors: kNotFinite (LAPACK hangs or lies on NaN and Inf, so it never sees one), kNumerical (no
/// convergence).
Expected<TruncatedSvd> truncated_svd(const ColMajorMatrixXf& matrix, std::int64_t rank, SvdMethod method);

/// The left singular vectors whose singular values are above `floor`: by randomised iteration for 32, and for
/// twice as many as long as all that are found are above it; by the Gram matrix where that is faster.
/// floor: at least 0. Otherwise as truncated_svd.
Expected<TruncatedSvd> svd_above(const ColMajorMatrixXf& matrix, double floor);

/// Coefficients C (r × columns) that minimise |matrix - basis C| for a basis (rows × r) that quantisation has
/// left a little off orthonormal; the plain projection basisᵀ matrix where the basis has lost its rank.
RowMajorMatrixXf least_squares_coefficients(const ColMajorMatrixXf& basis, const ColMajorMatrixXf& matrix);

}  // namespace batchenc
