#pragma once

#include <memory>

#include "codecs/clip_bitstream.h"
#include "codecs/clip_codec.h"

namespace batchenc {

// SplitCoder (chapter 5) and beyond: near-lossless animation. The first frame is coded by the static coder;
// every vertex of the frames after it is predicted from what both sides have decoded, of this frame and of
// those before, and the residual is rounded and entropy-coded in contexts by the residuals nearby. No vertex
// of any frame is farther from its source than the bound (parameters.max_error, or e_max / 2^bits).

/// See encode_clip; there is no segmentation. `auto` is `fitted`, and in clips of a few frames the one of
/// `fitted`, `local-multiway` and `lorenzo-multiway` that makes the smallest stream.
Expected<EncodedClip> encode_splitcoder(PositionsView positions, const MeshTopology& mesh,
                                        const CodecParameters& parameters, const Executor& executor);

/// Parameters and counts from the sections of a clip coded by encode_splitcoder. Errors: kCorrupt.
Expected<ClipInfo> read_splitcoder_info(const ClipBitstream& clip);

/// See decode_clip. All frames are decoded at once and kept.
Expected<std::unique_ptr<DecodedClip>> decode_splitcoder(const ClipBitstream& clip, const SharedMesh& mesh,
                                                         std::int64_t size_limit_bytes,
                                                         const Executor& executor);

}  // namespace batchenc
