#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "core/mesh_sequence.h"

namespace batchenc {

/// Axis-aligned bounding box over all frames of a clip, world units.
struct BoundingBox {
    std::array<float, 3> low{};
    std::array<float, 3> high{};

    /// e_max: the largest side.
    double largest_side() const {
        double side = 0.0;
        for (std::size_t c = 0; c < 3; ++c) side = std::max(side, static_cast<double>(high[c]) - low[c]);
        return side;
    }

    double diagonal() const {
        double squared = 0.0;
        for (std::size_t c = 0; c < 3; ++c) {
            const double side = static_cast<double>(high[c]) - low[c];
            squared += side * side;
        }
        return std::sqrt(squared);
    }

    std::array<float, 3> center() const {
        std::array<float, 3> middle;
        for (std::size_t c = 0; c < 3; ++c)
            middle[c] = static_cast<float>(0.5 * (static_cast<double>(low[c]) + high[c]));
        return middle;
    }
};

/// positions: F × V, both at least 1, finite.
BoundingBox bounding_box(PositionsView positions);

}  // namespace batchenc
