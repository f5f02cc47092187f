#pragma once

#include <memory>

#include "codecs/baselines/baseline_header.h"
#include "codecs/clip_bitstream.h"
#include "codecs/clip_codec.h"

namespace batchenc {

// baseline-coddyac: principal components of the trajectories of all vertices (L. Váša and V. Skala, "CODDYAC:
// connectivity driven dynamic mesh compression", 2007), their basis coded along time (L. Váša and V. Skala,
// "COBRA: compression of the basis for PCA represented animations", 2009).

/// See encode_clip.
Expected<EncodedClip> encode_trajectory_baseline(PositionsView positions, const MeshTopology& mesh,
                                                 const CodecParameters& parameters, BaselineHeader header,
                                                 const Executor& executor);

/// See decode_clip.
Expected<std::unique_ptr<DecodedClip>> decode_trajectory_baseline(const ClipBitstream& clip,
                                                                  const SharedMesh& mesh,
                                                                  std::int32_t components,
                                                                  std::int64_t size_limit_bytes);

}  // namespace batchenc
