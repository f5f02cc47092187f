#pragma once

#include <memory>

#include "codecs/clip_bitstream.h"
#include "codecs/clip_codec.h"

namespace batchenc {

// PDCT (chapter 7): local coordinates of each cluster as they differ from the clip's first frame, the
// vertices along a walk over the surface, by an orthonormal cosine transform; with `temporal`, along blocks
// of frames as well. Levels are coded as they differ from those before. As the transform is linear, that is
// the thesis' closed loop: the transform of what a frame differs from the decoded frame before is the
// difference of the transforms. What is predicted from is integers, so that no machine's rounding feeds back.

/// See encode_clip. Clusters and their LCFs as RLPCA has them; the first frame by the static coder, or where
/// there are no triangles by transform of its local coordinates.
Expected<EncodedClip> encode_pdct(PositionsView positions, const MeshTopology& mesh,
                                  const Segmentation& segmentation, const CodecParameters& parameters,
                                  const Executor& executor);

/// Parameters and counts from the sections of a clip coded by encode_pdct. Errors: kCorrupt.
Expected<ClipInfo> read_pdct_info(const ClipBitstream& clip);

/// See decode_clip; there are no components.
Expected<std::unique_ptr<DecodedClip>> decode_pdct(const ClipBitstream& clip, const SharedMesh& mesh,
                                                   std::int64_t size_limit_bytes, const Executor& executor);

}  // namespace batchenc
