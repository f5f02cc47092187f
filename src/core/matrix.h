#pragma once

#include <Eigen/Core>

namespace batchenc {

// Matrix aliases. The storage order stands in every name, because a silent transposition is the commonest
// defect of code that speaks to BLAS, HDF5 and Eigen at once.

using ColMajorMatrixXd = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor>;
using ColMajorMatrixXf = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor>;
using RowMajorMatrixXf = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using RowMajorMatrixXd = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using ColMajorMatrix3Xf = Eigen::Matrix<float, 3, Eigen::Dynamic, Eigen::ColMajor>;

}  // namespace batchenc
