#pragma once

#include <memory>

#include "codecs/baselines/baseline_header.h"
#include "codecs/clip_bitstream.h"
#include "codecs/clip_codec.h"

namespace batchenc {

// Affine motion of clusters with residuals by cosine transform along time (J. Lengyel, "Compression of
// time-dependent geometry", 1999; K. Mamou, T. Zaharia and F. Prêteux, "FAMC: the MPEG-4 standard for
// animated mesh compression", 2008; 2.4.2.1). docs/BASELINES.md says what is coded.

/// See encode_clip. header: of this clip. Error: kLimit.
Expected<EncodedClip> encode_affine_motion(PositionsView positions, const MeshTopology& mesh,
                                           const Segmentation& segmentation, BaselineHeader header,
                                           const Executor& executor);

/// See decode_clip.
Expected<std::unique_ptr<DecodedClip>> decode_affine_motion(const ClipBitstream& clip, const SharedMesh& mesh,
                                                            std::int64_t size_limit_bytes,
                                                            const Executor& executor);

}  // namespace batchenc
