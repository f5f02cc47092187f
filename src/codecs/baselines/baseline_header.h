#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "codecs/clip_bitstream.h"
#include "codecs/clip_codec.h"
#include "core/error.h"
#include "core/mesh_sequence.h"
#include "core/parameters.h"

namespace batchenc {

/// The content of every baseline's parameters section: what the job asked for, and the clip's lattice.
struct BaselineHeader {
    std::int32_t bits = 12;
    std::int32_t basis_bits = 12;
    std::int32_t coefficient_bits = 12;
    std::int32_t lpc_order = 2;
    GeometryPredictor predictor = GeometryPredictor::kAuto;
    std::int32_t components = 0;     ///< most that any cluster has; 0 of coders without
    std::int32_t cluster_count = 0;  ///< 0 of coders without
    std::array<float, 3> center{};   ///< of the bounding box of all frames: the origin of lattices
    float largest_side = 0.0f;       ///< e_max, world units

    /// Error: kLimit, a box that float32 cannot say.
    static Expected<BaselineHeader> of(PositionsView positions, const CodecParameters& parameters);

    /// Quantisation step, world units: e_max / 2^bits; 0 where all vertices are one point.
    double step() const;

    std::vector<std::uint8_t> write() const;
    /// Error: kCorrupt.
    static Expected<BaselineHeader> read(std::span<const std::uint8_t> payload);
};

/// Fails with kLimit where a decoder would need more than is allowed for V vertices and F frames that are
/// all kept. bytes_per_sample: of one vertex in one frame, positions included.
Expected<void> check_size(const ClipBitstream& clip, std::int64_t size_limit_bytes,
                          std::int64_t bytes_per_vertex, std::int64_t bytes_per_sample);

}  // namespace batchenc
