#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "codecs/split_layout.h"
#include "core/executor.h"
#include "core/mesh_sequence.h"
#include "kernels/mesh_topology.h"

namespace batchenc {

// SplitCoder's `fitted` predictor (kernels/motion_fit.h): frames after the first as whole lattice points.

/// Codes frames 1 … of a clip; frame 0 of `decoded` is what the decoder has of it, the others become what it
/// will decode. positions, decoded: F × V, F at least 2. The bytes do not depend on the executor.
std::vector<std::uint8_t> encode_fitted(PositionsView positions, const MeshTopology& mesh,
                                        const SplitHeader& header, MutablePositionsView decoded,
                                        const Executor& executor);
/// The way back. Error: kCorrupt.
Expected<void> decode_fitted(std::span<const std::uint8_t> bytes, const MeshTopology& mesh,
                             const SplitHeader& header, MutablePositionsView decoded,
                             const Executor& executor);

}  // namespace batchenc
