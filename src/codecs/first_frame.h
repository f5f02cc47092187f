#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/error.h"
#include "core/executor.h"
#include "core/mesh_sequence.h"
#include "kernels/mesh_topology.h"

namespace batchenc {

// The first frame of coders that predict all others from it: a whole clip bitstream of the static coder.

struct CodedFirstFrame {
    std::vector<std::uint8_t> bitstream;
    std::vector<float> positions;  ///< V × 3, as a decoder has them
};

/// positions: of the clip. bound: no vertex is farther from its source, world units; 0 where all vertices of
/// all frames are one point. Errors: those of encode_static.
Expected<CodedFirstFrame> encode_first_frame(PositionsView positions, const MeshTopology& mesh, double bound,
                                             const Executor& executor);

/// The way back, into frame: 1 × V of the mesh; all finite. Errors: those of decode_static_frame; kCorrupt.
Expected<void> decode_first_frame(std::span<const std::uint8_t> bitstream, const MeshTopology& mesh,
                                  std::int64_t size_limit_bytes, MutablePositionsView frame,
                                  const Executor& executor);

}  // namespace batchenc
