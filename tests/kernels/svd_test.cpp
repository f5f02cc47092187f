#include "kernels/svd.h"

#include <gtest/gtest.h>

#include <Eigen/SVD>
#include <limits>
#include <random>

namespace batchenc {
namespace {

/// Matrix with singular values that fall by `decay` each.
ColMajorMatrixXf decaying_matrix(Eigen::Index rows, Eigen::Index columns, double decay, unsigned seed) {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    const Eigen::Index k = std::min(rows, columns);
    const auto orthonormal = [&](Eigen::Index n) {
        const Eigen::MatrixXd m = Eigen::MatrixXd::NullaryExpr(n, k, [&] { return normal(random); });
        return Eigen::MatrixXd(Eigen::HouseholderQR<Eigen::MatrixXd>(m).householderQ() *
                               Eigen::MatrixXd::Identity(n, k));
    };
    Eigen::VectorXd sigma(k);
    for (Eigen::Index i = 0; i < k; ++i) sigma[i] = 100.0 * std::pow(decay, static_cast<double>(i));
    return (orthonormal(rows) * sigma.asDiagonal() * orthonormal(columns).transpose()).cast<float>();
}

const SvdMethod kMethods[] = {SvdMethod::kDirect, SvdMethod::kGram, SvdMethod::kRandomized};

// By residual and orthogonality, never by raw vectors, whose signs and order within a tie are LAPACK's
// business.
TEST(TruncatedSvd, ResidualIsNearTheSmallestPossible) {
    const std::pair<Eigen::Index, Eigen::Index> shapes[] = {{300, 60}, {60, 300}, {40, 40}, {7, 3},
                                                            {3, 7},    {1, 9},    {9, 1},   {1, 1}};
    for (const auto& [rows, columns] : shapes) {
        for (const double decay : {0.5, 0.8, 0.97}) {
            const ColMajorMatrixXf a = decaying_matrix(rows, columns, decay, 1);
            const Eigen::VectorXd sigma =
                Eigen::JacobiSVD<Eigen::MatrixXd>(a.cast<double>()).singularValues();
            for (const Eigen::Index rank : {Eigen::Index{1}, Eigen::Index{5}, Eigen::Index{20}}) {
                for (const SvdMethod method : kMethods) {
                    const auto svd = truncated_svd(a, rank, method);
                    ASSERT_TRUE(svd) << svd.error().to_string();
                    const Eigen::MatrixXd u = svd->basis.cast<double>();
                    const Eigen::Index r = u.cols();
                    ASSERT_LE(r, std::min(rank, sigma.size()));
                    EXPECT_LT((u.transpose() * u - Eigen::MatrixXd::Identity(r, r)).norm(), 1e-4);
                    const double residual =
                        (a.cast<double>() - u * (u.transpose() * a.cast<double>())).norm();
                    const double smallest = sigma.tail(sigma.size() - std::min(rank, sigma.size())).norm();
                    // A flat spectrum is where two power iterations are least exact; 2 % in the residual
                    // there.
                    EXPECT_LE(residual, 1.02 * smallest + 3e-5 * sigma[0])
                        << rows << "x" << columns << " decay " << decay << " rank " << rank << " method "
                        << static_cast<int>(method);
                    for (Eigen::Index l = 0; l < std::min<Eigen::Index>(r, 4); ++l) {
                        // Single values of a flat spectrum are not what subspace iteration finds; their span
                        // is.
                        const double tolerance =
                            method == SvdMethod::kRandomized && decay > 0.9 ? 0.1 : 0.001;
                        EXPECT_NEAR(svd->singular_values[l], sigma[l], tolerance * sigma[l]) << l;
                    }
                }
            }
        }
    }
}

TEST(TruncatedSvd, GivesNoMoreThanTheRank) {
    for (const SvdMethod method : kMethods) {
        ColMajorMatrixXf a = ColMajorMatrixXf::Zero(50, 20);
        a.col(3).setConstant(2.0f);
        a.col(7).setLinSpaced(-1.0f, 1.0f);
        const auto svd = truncated_svd(a, 10, method);
        ASSERT_TRUE(svd);
        EXPECT_EQ(svd->basis.cols(), 2) << static_cast<int>(method);
        const auto zero = truncated_svd(ColMajorMatrixXf::Zero(6, 4), 3, method);
        ASSERT_TRUE(zero);
        EXPECT_EQ(zero->basis.cols(), 0);
        EXPECT_EQ(zero->basis.rows(), 6);
    }
}

TEST(TruncatedSvd, RefusesNaNAndInf) {
    for (const float bad :
         {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
        ColMajorMatrixXf a = ColMajorMatrixXf::Ones(8, 8);
        a(3, 4) = bad;
        for (const SvdMethod method : kMethods) {
            const auto svd = truncated_svd(a, 2, method);
            ASSERT_FALSE(svd);
            EXPECT_EQ(svd.error().code, ErrorCode::kNotFinite);
        }
    }
}

TEST(TruncatedSvd, GivesTheSameBitsTwice) {
    const ColMajorMatrixXf a = decaying_matrix(200, 90, 0.9, 7);
    for (const SvdMethod method : kMethods) {
        EXPECT_EQ(truncated_svd(a, 12, method)->basis, truncated_svd(a, 12, method)->basis);
    }
}

TEST(SvdAbove, GivesTheVectorsAboveAFloor) {
    for (const auto& [rows, columns] : {std::pair<Eigen::Index, Eigen::Index>{300, 60}, {60, 300}, {3, 1}}) {
        const ColMajorMatrixXf a = decaying_matrix(rows, columns, 0.8, 2);
        const auto reference = truncated_svd(a, columns, SvdMethod::kDirect);
        ASSERT_TRUE(reference);
        for (const Eigen::Index count : {Eigen::Index{0}, Eigen::Index{1}, Eigen::Index{9}}) {
            if (count > reference->singular_values.size()) continue;
            // Between two values, which are a fifth apart.
            const double floor = count == 0 ? 110.0 : 0.9 * reference->singular_values[count - 1];
            const auto svd = svd_above(a, floor);
            ASSERT_TRUE(svd) << svd.error().to_string();
            ASSERT_EQ(svd->singular_values.size(), count) << rows << " x " << columns;
            const Eigen::MatrixXf ours = svd->basis, theirs = reference->basis.leftCols(count);
            // The same span, and the same values.
            EXPECT_LT((ours - theirs * (theirs.transpose() * ours)).norm(), 1e-3);
            EXPECT_LT((svd->singular_values - reference->singular_values.head(count)).norm(), 0.01);
        }
    }
    const auto zero = svd_above(ColMajorMatrixXf::Zero(6, 4), 0.0);
    ASSERT_TRUE(zero);
    EXPECT_EQ(zero->basis.cols(), 0);
    ColMajorMatrixXf bad = ColMajorMatrixXf::Ones(4, 4);
    bad(1, 1) = std::numeric_limits<float>::quiet_NaN();
    EXPECT_EQ(svd_above(bad, 1.0).error().code, ErrorCode::kNotFinite);
}

// Both sides are long, so that it is found by iteration, first too few of them and then enough.
TEST(SvdAbove, DoublesItsGuessOfTheRank) {
    constexpr Eigen::Index kRows = 1060, kColumns = 1040, kRank = 90;
    std::mt19937 random(4);
    std::normal_distribution<float> normal;
    const auto orthonormal = [&](Eigen::Index n) {
        const Eigen::MatrixXf m = Eigen::MatrixXf::NullaryExpr(n, kRank, [&] { return normal(random); });
        return Eigen::MatrixXf(Eigen::HouseholderQR<Eigen::MatrixXf>(m).householderQ() *
                               Eigen::MatrixXf::Identity(n, kRank));
    };
    Eigen::VectorXf sigma(kRank);
    for (Eigen::Index i = 0; i < kRank; ++i) sigma[i] = 1000.0f * std::pow(0.95f, static_cast<float>(i));
    const Eigen::MatrixXf left = orthonormal(kRows);
    const ColMajorMatrixXf a = left * sigma.asDiagonal() * orthonormal(kColumns).transpose();
    for (const Eigen::Index count : {Eigen::Index{40}, Eigen::Index{80}}) {
        const auto svd = svd_above(a, 0.975 * static_cast<double>(sigma[count - 1]));
        ASSERT_TRUE(svd);
        ASSERT_EQ(svd->singular_values.size(), count);
        for (Eigen::Index l = 0; l < count; ++l)
            EXPECT_NEAR(svd->singular_values[l], sigma[l], 1e-3f * sigma[l]) << l;
        const Eigen::MatrixXf span = left.leftCols(count);
        EXPECT_LT((svd->basis - span * (span.transpose() * svd->basis)).norm(), 1e-2);
    }
}

TEST(LeastSquares, MinimisesTheResidualOfABentBasis) {
    const ColMajorMatrixXf a = decaying_matrix(80, 30, 0.8, 3);
    ColMajorMatrixXf basis = truncated_svd(a, 6, SvdMethod::kDirect)->basis;
    basis = (basis * 16.0f).array().round() / 16.0f;  // coarsely quantised
    const RowMajorMatrixXf c = least_squares_coefficients(basis, a);
    const Eigen::MatrixXd expected = basis.cast<double>().colPivHouseholderQr().solve(a.cast<double>());
    EXPECT_LT((c.cast<double>() - expected).norm(), 1e-4 * expected.norm());
}

TEST(LeastSquares, ProjectsWhereTheBasisHasLostItsRank) {
    ColMajorMatrixXf basis = ColMajorMatrixXf::Zero(10, 2);
    basis.col(0).setConstant(0.3f);  // the second column is zero
    const RowMajorMatrixXf c = least_squares_coefficients(basis, ColMajorMatrixXf::Ones(10, 4));
    EXPECT_TRUE(c.allFinite());
    EXPECT_NEAR(c(0, 0), 3.0f, 1e-5f);
}

}  // namespace
}  // namespace batchenc
