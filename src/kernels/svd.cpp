#include "kernels/svd.h"

#include <cblas.h>
#include <lapacke.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace batchenc {
namespace {

constexpr double kRankTolerance = 1e-6;
constexpr std::int64_t kOversampling = 8;
constexpr int kPowerIterations = 2;

tl::unexpected<Error> lapack_failure(const char* routine, lapack_int info) {
    return fail(ErrorCode::kNumerical, std::string(routine) + " returned " + std::to_string(info));
}

int to_int(Eigen::Index n) { return static_cast<int>(n); }

/// c = op(a) op(b)
void product(const ColMajorMatrixXf& a, bool transpose_a, const ColMajorMatrixXf& b, bool transpose_b,
             ColMajorMatrixXf& c) {
    const auto m = transpose_a ? a.cols() : a.rows();
    const auto k = transpose_a ? a.rows() : a.cols();
    const auto n = transpose_b ? b.rows() : b.cols();
    c.resize(m, n);
    cblas_sgemm(CblasColMajor, transpose_a ? CblasTrans : CblasNoTrans,
                transpose_b ? CblasTrans : CblasNoTrans, to_int(m), to_int(n), to_int(k), 1.0f, a.data(),
                to_int(a.rows()), b.data(), to_int(b.rows()), 0.0f, c.data(), to_int(c.rows()));
}

std::int64_t numerical_rank(const Eigen::VectorXd& values, std::int64_t wanted) {
    std::int64_t rank = 0;
    while (rank < std::min<std::int64_t>(wanted, values.size()) && values[rank] > 0.0 &&
           values[rank] > kRankTolerance * values[0])
        ++rank;
    return rank;
}

Expected<TruncatedSvd> direct_svd(const ColMajorMatrixXf& matrix, std::int64_t rank) {
    ColMajorMatrixXd a = matrix.cast<double>();
    const auto m = to_int(a.rows()), n = to_int(a.cols()), k = std::min(m, n);
    Eigen::VectorXd values(k);
    ColMajorMatrixXd u(m, k), vt(k, n);
    const lapack_int info =
        LAPACKE_dgesdd(LAPACK_COL_MAJOR, 'S', m, n, a.data(), m, values.data(), u.data(), m, vt.data(), k);
    if (info != 0) return lapack_failure("dgesdd", info);
    const std::int64_t r = numerical_rank(values, rank);
    return TruncatedSvd{u.leftCols(r).cast<float>(), values.head(r).cast<float>()};
}

/// Eigenvalues and vectors of a symmetric matrix (upper triangle; overwritten), largest first: the largest
/// `wanted`, as far as they are above `floor` where that is not negative.
Expected<std::pair<Eigen::VectorXd, ColMajorMatrixXd>> leading_eigenvectors(ColMajorMatrixXd& symmetric,
                                                                            std::int64_t wanted,
                                                                            double floor) {
    const auto n = to_int(symmetric.rows());
    const auto k = static_cast<int>(std::min<std::int64_t>(wanted, n));
    const bool by_value = floor >= 0.0;
    Eigen::VectorXd values(n);
    ColMajorMatrixXd vectors(n, by_value ? n : k);
    std::vector<lapack_int> support(static_cast<std::size_t>(2 * std::max(1, n)));
    lapack_int found = 0;
    const double top = std::numeric_limits<double>::max();
    const lapack_int info =
        LAPACKE_dsyevr(LAPACK_COL_MAJOR, 'V', by_value ? 'V' : 'I', 'U', n, symmetric.data(), n, floor, top,
                       n - k + 1, n, 0.0, &found, values.data(), vectors.data(), n, support.data());
    if (info != 0 || (!by_value && found != k)) return lapack_failure("dsyevr", info);
    return std::pair{Eigen::VectorXd(values.head(found).reverse()),
                     ColMajorMatrixXd(vectors.leftCols(found).rowwise().reverse())};
}

/// floor: of singular values; negative for none.
Expected<TruncatedSvd> gram_svd(const ColMajorMatrixXf& matrix, std::int64_t rank, double floor = -1.0) {
    const ColMajorMatrixXd a = matrix.cast<double>();
    const auto m = to_int(a.rows()), n = to_int(a.cols());
    const bool tall = m >= n;
    const int size = std::min(m, n);
    ColMajorMatrixXd gram(size, size);
    cblas_dsyrk(CblasColMajor, CblasUpper, tall ? CblasTrans : CblasNoTrans, size, tall ? m : n, 1.0,
                a.data(), m, 0.0, gram.data(), size);
    auto eigen = leading_eigenvectors(gram, rank, floor < 0.0 ? -1.0 : floor * floor);
    if (!eigen) return tl::unexpected(eigen.error());
    const Eigen::VectorXd values = eigen->first.cwiseMax(0.0).cwiseSqrt();
    const std::int64_t r = numerical_rank(values, rank);
    if (!tall) return TruncatedSvd{eigen->second.leftCols(r).cast<float>(), values.head(r).cast<float>()};
    // U = A V / sigma. Squaring has cost the small values half their digits; one pass of Gram-Schmidt gives
    // them back.
    ColMajorMatrixXd u(m, r);
    cblas_dgemm(CblasColMajor, CblasNoTrans, CblasNoTrans, m, to_int(r), n, 1.0, a.data(), m,
                eigen->second.data(), n, 0.0, u.data(), m);
    for (std::int64_t l = 0; l < r; ++l) {
        if (l > 0) u.col(l) -= u.leftCols(l) * (u.leftCols(l).transpose() * u.col(l)).eval();
        u.col(l).normalize();
    }
    return TruncatedSvd{u.cast<float>(), values.head(r).cast<float>()};
}

/// Orthonormal basis of the columns of a tall matrix, in place. False when LAPACK fails.
bool orthonormalize(ColMajorMatrixXf& q) {
    const auto m = to_int(q.rows()), k = to_int(q.cols());
    std::vector<float> tau(static_cast<std::size_t>(k));
    return LAPACKE_sgeqrf(LAPACK_COL_MAJOR, m, k, q.data(), m, tau.data()) == 0 &&
           LAPACKE_sorgqr(LAPACK_COL_MAJOR, m, k, k, q.data(), m, tau.data()) == 0;
}

/// The same start for every matrix: values in [-1, 1) from a fixed linear congruential sequence (Knuth's MMIX
/// constants), so that the bytes of a result depend on nothing but its input.
ColMajorMatrixXf start_block(std::int64_t rows, std::int64_t columns) {
    ColMajorMatrixXf block(rows, columns);
    std::uint64_t state = 0x9e3779b97f4a7c15ull;
    for (Eigen::Index i = 0; i < block.size(); ++i) {
        state = state * 6364136223846793005ull + 1442695040888963407ull;
        block.data()[i] = static_cast<float>(static_cast<std::int32_t>(state >> 32)) * 0x1p-31f;
    }
    return block;
}

Expected<TruncatedSvd> randomized_svd(const ColMajorMatrixXf& matrix, std::int64_t rank) {
    const std::int64_t k = std::min({rank + kOversampling, static_cast<std::int64_t>(matrix.rows()),
                                     static_cast<std::int64_t>(matrix.cols())});
    ColMajorMatrixXf left, right = start_block(matrix.cols(), k);
    for (int i = 0; i <= kPowerIterations; ++i) {
        product(matrix, false, right, false, left);
        if (!orthonormalize(left)) return lapack_failure("sgeqrf", -1);
        if (i == kPowerIterations) break;
        product(matrix, true, left, false, right);
        if (!orthonormalize(right)) return lapack_failure("sgeqrf", -1);
    }
    // Rayleigh-Ritz: the singular vectors of the small leftᵀ A turn `left` into those of A.
    ColMajorMatrixXf small;
    product(left, true, matrix, false, small);
    auto inner = gram_svd(small, rank);
    if (!inner) return tl::unexpected(inner.error());
    TruncatedSvd result;
    product(left, false, inner->basis, false, result.basis);
    result.singular_values = inner->singular_values;
    return result;
}

}  // namespace

SvdMethod choose_svd_method(std::int64_t rows, std::int64_t columns, std::int64_t rank) {
    const std::int64_t smaller = std::min(rows, columns);
    if (smaller <= 4) return SvdMethod::kDirect;
    // Measured on one thread, in ms, direct / Gram / randomised: 1050 x 200 rank 20: 22 / 5.8 / 2.9; rank 40:
    // 22 / 7.8 / 5.6; 450 x 400 rank 20: 48 / 15 / 2.3; 6300 x 48 rank 20: 10 / 3.1 / 7.1; 60 x 200 rank
    // 20: 1.3 / 0.7 / 0.7.
    const std::int64_t block = rank + kOversampling;
    return 3 * block < smaller ? SvdMethod::kRandomized : SvdMethod::kGram;
}

Expected<TruncatedSvd> truncated_svd(const ColMajorMatrixXf& matrix, std::int64_t rank, SvdMethod method) {
    if (!matrix.allFinite())
        return fail(ErrorCode::kNotFinite, "the matrix of local coordinates holds NaN or Inf");
    if ((matrix.array() == 0.0f).all())
        return TruncatedSvd{ColMajorMatrixXf(matrix.rows(), 0), Eigen::VectorXf(0)};
    switch (method) {
        case SvdMethod::kDirect:
            return direct_svd(matrix, rank);
        case SvdMethod::kGram:
            return gram_svd(matrix, rank);
        case SvdMethod::kRandomized:
            return randomized_svd(matrix, rank);
    }
    return fail(ErrorCode::kInternal, "no such SVD method");
}

Expected<TruncatedSvd> svd_above(const ColMajorMatrixXf& matrix, double floor) {
    if (!matrix.allFinite())
        return fail(ErrorCode::kNotFinite, "the matrix of trajectories holds NaN or Inf");
    if ((matrix.array() == 0.0f).all())
        return TruncatedSvd{ColMajorMatrixXf(matrix.rows(), 0), Eigen::VectorXf(0)};
    constexpr std::int64_t kFirstRank = 32;
    const std::int64_t smaller = std::min(matrix.rows(), matrix.cols());
    for (std::int64_t rank = kFirstRank;
         choose_svd_method(matrix.rows(), matrix.cols(), rank) == SvdMethod::kRandomized; rank *= 2) {
        auto svd = randomized_svd(matrix, rank);
        if (!svd) return svd;
        std::int64_t above = 0;
        while (above < svd->singular_values.size() &&
               static_cast<double>(svd->singular_values[above]) > floor)
            ++above;
        if (above == rank) continue;
        return TruncatedSvd{svd->basis.leftCols(above), svd->singular_values.head(above)};
    }
    return gram_svd(matrix, smaller, floor);
}

RowMajorMatrixXf least_squares_coefficients(const ColMajorMatrixXf& basis, const ColMajorMatrixXf& matrix) {
    ColMajorMatrixXf projected;  // columns × r, which is r × columns row by row
    product(matrix, true, basis, false, projected);
    const auto r = to_int(basis.cols());
    ColMajorMatrixXd gram(r, r);
    const ColMajorMatrixXd b = basis.cast<double>();
    cblas_dsyrk(CblasColMajor, CblasUpper, CblasTrans, r, to_int(b.rows()), 1.0, b.data(), to_int(b.rows()),
                0.0, gram.data(), r);
    RowMajorMatrixXf coefficients = Eigen::Map<const RowMajorMatrixXf>(projected.data(), r, matrix.cols());
    ColMajorMatrixXd right = coefficients.cast<double>();
    if (LAPACKE_dposv(LAPACK_COL_MAJOR, 'U', r, to_int(right.cols()), gram.data(), r, right.data(), r) == 0 &&
        right.allFinite()) {
        coefficients = right.cast<float>();
    }
    return coefficients;
}

}  // namespace batchenc
