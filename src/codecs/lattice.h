#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "kernels/bending_angle.h"

namespace batchenc {

/// The lattice of decoded vertices: points center + spacing × (i, j, k).
class Lattice {
 public:
    /// spacing: world units; where it or its inverse is 0 or not finite, every place is (0, 0, 0).
    Lattice(const std::array<float, 3>& center, double spacing) : spacing_(spacing) {
        per_unit_ = spacing > 0.0 && std::isfinite(1.0 / spacing) ? 1.0 / spacing : 0.0;
        for (std::size_t c = 0; c < 3; ++c) center_[c] = static_cast<double>(center[c]);
    }

    double spacing() const { return spacing_; }
    double per_unit() const { return per_unit_; }
    /// A coordinate in lattice units.
    double place_of(float value, std::size_t c) const {
        return (static_cast<double>(value) - center_[c]) * per_unit_;
    }
    std::array<double, 3> place_of(const float* world) const {
        return {place_of(world[0], 0), place_of(world[1], 1), place_of(world[2], 2)};
    }
    /// The lattice point nearest to a position, within kFurthest.
    LatticePoint nearest_point(const float* world) const {
        constexpr double kLimit = kFurthest;
        LatticePoint point;
        for (std::size_t c = 0; c < 3; ++c) {
            const double value = std::floor(place_of(world[c], c) + 0.5);
            point[c] =
                static_cast<std::int32_t>(value > -kLimit ? (value < kLimit ? value : kLimit) : -kLimit);
        }
        return point;
    }
    /// Limited to what float32 can say, beyond which only a corrupt stream leads.
    float to_world(std::int32_t coordinate, std::size_t c) const {
        constexpr double kMost = std::numeric_limits<float>::max();
        return static_cast<float>(
            std::clamp(center_[c] + static_cast<double>(coordinate) * spacing_, -kMost, kMost));
    }
    void to_world(const LatticePoint& point, float* world) const {
        for (std::size_t c = 0; c < 3; ++c) world[c] = to_world(point[c], c);
    }

    static constexpr std::int32_t kFurthest = 1 << 29;  ///< largest coordinate of a point

 private:
    std::array<double, 3> center_{};
    double spacing_, per_unit_ = 0.0;
};

}  // namespace batchenc
