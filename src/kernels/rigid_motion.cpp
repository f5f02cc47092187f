#include "kernels/rigid_motion.h"

#include <cblas.h>

#include <Eigen/LU>
#include <Eigen/SVD>

#include "core/matrix.h"

namespace batchenc {
namespace {

/// n × 4: places at rest about their mean, and 1/n in the last column.
ColMajorMatrixXf rest_about_mean(std::span<const std::int32_t> members, std::span<const float> rest) {
    const auto n = static_cast<Eigen::Index>(members.size());
    ColMajorMatrixXf places(n, 4);
    for (Eigen::Index k = 0; k < n; ++k) {
        const float* r = rest.data() + 3 * static_cast<std::ptrdiff_t>(members[static_cast<std::size_t>(k)]);
        for (Eigen::Index axis = 0; axis < 3; ++axis) places(k, axis) = r[axis];
    }
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
        const double mean = places.col(axis).cast<double>().mean();
        places.col(axis) = (places.col(axis).cast<double>().array() - mean).cast<float>();
    }
    places.col(3).setConstant(1.0f / static_cast<float>(n));
    return places;
}

/// n × 3F: positions relative to the first member in the same frame, so that float32 keeps their digits.
ColMajorMatrixXf relative_positions(PositionsView positions, std::span<const std::int32_t> members) {
    ColMajorMatrixXf relative(static_cast<Eigen::Index>(members.size()), 3 * positions.frame_count());
    for (std::int64_t f = 0; f < positions.frame_count(); ++f) {
        const float* first = positions.at(f, members[0]);
        float* x = relative.col(3 * f).data();
        float* y = relative.col(3 * f + 1).data();
        float* z = relative.col(3 * f + 2).data();
        for (const std::int32_t v : members) {
            const float* p = positions.at(f, v);
            *x++ = p[0] - first[0];
            *y++ = p[1] - first[1];
            *z++ = p[2] - first[2];
        }
    }
    return relative;
}

}  // namespace

LocalFrameTrack rigid_motion(PositionsView positions, std::span<const std::int32_t> members,
                             std::span<const float> rest) {
    const ColMajorMatrixXf places = rest_about_mean(members, rest);
    const ColMajorMatrixXf relative = relative_positions(positions, members);
    const auto n = static_cast<int>(members.size());
    const auto columns = static_cast<int>(relative.cols());
    // Row a < 3, column 3f + b: sum over k of r_k[a] p_k[b]; row 3: the centroid.
    ColMajorMatrixXf sums(4, columns);
    cblas_sgemm(CblasColMajor, CblasTrans, CblasNoTrans, 4, columns, n, 1.0f, places.data(), n,
                relative.data(), n, 0.0f, sums.data(), 4);

    LocalFrameTrack track(positions.frame_count());
    Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
    for (std::int64_t f = 0; f < positions.frame_count(); ++f) {
        // The rotation that maximises trace(T K), K = sum of p rᵀ. A breath of the frame before decides what
        // K leaves open.
        Eigen::Matrix3d covariance = sums.block<3, 3>(0, 3 * f).cast<double>().transpose();
        covariance += (1e-7 * covariance.norm() + 1e-30) * rotation.transpose();
        // Squares that float32 does not hold say nothing of the rotation either.
        if (!covariance.allFinite()) covariance = rotation.transpose();
        const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
        const double handedness =
            (svd.matrixV() * svd.matrixU().transpose()).determinant() < 0.0 ? -1.0 : 1.0;
        rotation =
            svd.matrixV() * Eigen::Vector3d(1.0, 1.0, handedness).asDiagonal() * svd.matrixU().transpose();
        LocalFrame lcf;
        const float* first = positions.at(f, members[0]);
        for (Eigen::Index a = 0; a < 3; ++a) {
            for (Eigen::Index b = 0; b < 3; ++b)
                lcf.rotation[static_cast<std::size_t>(3 * a + b)] = rotation(a, b);
            lcf.origin[static_cast<std::size_t>(a)] =
                static_cast<double>(first[a]) + static_cast<double>(sums(3, 3 * f + a));
        }
        track.set(f, lcf);
    }
    return track;
}

}  // namespace batchenc
