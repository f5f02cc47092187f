#include "codecs/orlpca_model.h"

#include <algorithm>
#include <cmath>

namespace batchenc {
namespace {

/// Squared errors of the matrix with the first l exact components, l = 0 … L.
std::vector<double> missed_by(const ColMajorMatrixXf& matrix, const ColMajorMatrixXf& components,
                              const ColMajorMatrixXf& coefficients) {
    constexpr Eigen::Index kBlockRows = 512;  // whose part of the basis stays in the cache over all frames
    const Eigen::Index count = components.cols();
    std::vector<double> errors(static_cast<std::size_t>(count) + 1);
    for (Eigen::Index first = 0; first < matrix.rows(); first += kBlockRows) {
        const Eigen::Index rows = std::min(kBlockRows, matrix.rows() - first);
        for (Eigen::Index f = 0; f < matrix.cols(); ++f) {
            Eigen::VectorXf left = matrix.col(f).segment(first, rows);
            errors[0] += left.cast<double>().squaredNorm();
            for (Eigen::Index l = 0; l < count; ++l) {
                left -= components.col(l).segment(first, rows) * coefficients(l, f);
                errors[static_cast<std::size_t>(l) + 1] += left.cast<double>().squaredNorm();
            }
        }
    }
    return errors;
}

double step_of(float low, float high, int bits) {
    return (static_cast<double>(high) - static_cast<double>(low)) / std::ldexp(1.0, bits);
}

}  // namespace

ComponentModel ComponentModel::of(const ColMajorMatrixXf& matrix, const ColMajorMatrixXf& components,
                                  const RlpcaHeader& header) {
    const ColMajorMatrixXf coefficients = components.transpose() * matrix;
    ComponentModel model;
    model.errors = missed_by(matrix, components, coefficients);
    model.basis_steps = model.coefficient_steps = {0.0};
    const auto rows = static_cast<double>(matrix.rows()), frames = static_cast<double>(matrix.cols());
    std::vector<double> energies;  // squared norms of the coefficients so far
    double energy = 0.0;
    float basis_low = 0.0f, basis_high = 0.0f, low = 0.0f, high = 0.0f;
    for (Eigen::Index l = 0; l < components.cols(); ++l) {
        const auto column = components.col(l);
        const auto row = coefficients.row(l);
        if (l == 0) {
            basis_low = basis_high = column[0];
            low = high = row[0];
        }
        basis_low = std::min(basis_low, column.minCoeff());
        basis_high = std::max(basis_high, column.maxCoeff());
        low = std::min(low, row.minCoeff());
        high = std::max(high, row.maxCoeff());
        const double basis_step = step_of(basis_low, basis_high, header.basis_bits);
        const double step = step_of(low, high, header.coefficient_bits);
        model.basis_steps.push_back(basis_step);
        model.coefficient_steps.push_back(step);
        energies.push_back(row.cast<double>().squaredNorm());
        energy += energies.back();
        // Rounding the basis bends it, each of 3n rows; for what stays in its span coefficients make up. Of
        // coefficients weaker than their rounding no more is lost than they are.
        double added = basis_step * basis_step / 12.0 * energy * (rows - static_cast<double>(l + 1));
        for (const double of_component : energies)
            added += std::min(frames * step * step / 12.0, of_component);
        model.errors[static_cast<std::size_t>(l) + 1] += added;
    }
    return model;
}

std::vector<RatePoint> ComponentModel::points_by_bits(const std::vector<double>& component_bits,
                                                      std::int64_t rows, std::int64_t frames) const {
    constexpr double kQuantizerBits = 128.0;  // two of them, which the first component brings
    const auto finer = [](double last, double step) { return step > 0.0 ? std::log2(last / step) : 0.0; };
    std::vector<RatePoint> points = {{0.0, errors[0]}};
    double bits = kQuantizerBits;
    for (std::size_t l = 1; l < errors.size(); ++l) {
        bits += component_bits[l - 1];
        const double more =
            static_cast<double>(rows) * finer(basis_steps.back(), basis_steps[l]) +
            static_cast<double>(frames) * finer(coefficient_steps.back(), coefficient_steps[l]);
        points.push_back({bits + static_cast<double>(l) * more, errors[l]});
    }
    return points;
}

std::vector<RatePoint> ComponentModel::points_by_numbers(std::int64_t rows, std::int64_t frames) const {
    std::vector<RatePoint> points;
    for (const double error : errors)
        points.push_back({static_cast<double>(points.size()) * static_cast<double>(rows + frames), error});
    return points;
}

}  // namespace batchenc
