#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/error.h"
#include "core/parameters.h"

namespace batchenc {

/// The content of SplitCoder's parameters section.
struct SplitHeader {
    GeometryPredictor predictor = GeometryPredictor::kFitted;  ///< never kAuto
    NormalPredictor normal = NormalPredictor::kTime;
    std::array<float, 3> center{};  ///< of the bounding box of all frames: the origin of lattices
    double bound = 0.0;             ///< largest distance of a vertex from its source, world units

    std::vector<std::uint8_t> write() const;
    /// Error: kCorrupt.
    static Expected<SplitHeader> read(std::span<const std::uint8_t> payload);
};

}  // namespace batchenc
