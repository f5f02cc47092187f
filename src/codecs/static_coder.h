#pragma once

#include <memory>

#include "codecs/clip_bitstream.h"
#include "codecs/clip_codec.h"
#include "kernels/bounding_box.h"

namespace batchenc {

// The static coder (chapter 3): every frame on its own. Vertices are walked in the order of a traversal that
// follows from the triangles; each is predicted from decoded neighbours, and the residual, along axes of the
// world or of the neighbourhood, is quantised in steps of e_max / 2^bits and entropy-coded in contexts by the
// residuals nearby. No vertex is farther from its source than e_max / 2^bits (3.1); where rounding would
// break that, the vertex is coded exactly.

/// See encode_clip; there is no segmentation. Of predictor `auto` all are tried
/// on every 32nd frame, and the frames after it take the best of that frame's three smallest.
Expected<EncodedClip> encode_static(PositionsView positions, const MeshTopology& mesh,
                                    const CodecParameters& parameters, const Executor& executor);

/// The largest distance that a vertex may have from its source, world units: what the parameters' target
/// says, or e_max / 2^bits. box: of the clip.
double bound_of(const CodecParameters& parameters, const BoundingBox& box);

/// Parameters and counts from the sections of a clip coded by encode_static. Errors: kCorrupt.
Expected<ClipInfo> read_static_info(const ClipBitstream& clip);

/// See decode_clip. Frames are decoded when they are asked for, each alone; what is corrupt in a frame shows
/// then (kCorrupt).
Expected<std::unique_ptr<DecodedClip>> decode_static(const ClipBitstream& clip, const SharedMesh& mesh,
                                                     std::int64_t size_limit_bytes, const Executor& executor);

/// Decodes a clip bitstream of this coder that holds the first frame of another coder's clip. frame: 1 × V of
/// the mesh. Errors: those of decode_clip; kCorrupt where it is of another shape or coder.
Expected<void> decode_static_frame(std::span<const std::uint8_t> bitstream, const MeshTopology& mesh,
                                   std::int64_t size_limit_bytes, MutablePositionsView frame,
                                   const Executor& executor);

}  // namespace batchenc
