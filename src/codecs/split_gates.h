#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "codecs/split_layout.h"
#include "core/executor.h"
#include "core/mesh_sequence.h"
#include "kernels/mesh_topology.h"

namespace batchenc {

// SplitCoder's predictors at gates, all but `fitted`: frames after the first along a traversal of the mesh.

/// Bits of the residuals' parts, for tables like figures 8.7 and 8.8.
struct SplitBits {
    double tangential = 0.0;
    double normal = 0.0;
};

/// Codes frames 1 … of a clip; frame 0 of `decoded` is what the decoder has of it, the others become what it
/// will decode. positions, decoded: F × V, F at least 2. bits: adds what the parts take, if not null.
std::vector<std::uint8_t> encode_gates(PositionsView positions, const MeshTopology& mesh,
                                       const SplitHeader& header, MutablePositionsView decoded,
                                       SplitBits* bits = nullptr);
/// The way back. Error: kCorrupt.
Expected<void> decode_gates(std::span<const std::uint8_t> bytes, const MeshTopology& mesh,
                            const SplitHeader& header, MutablePositionsView decoded);

}  // namespace batchenc
