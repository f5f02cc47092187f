#pragma once

#include <memory>

#include "codecs/baselines/baseline_header.h"
#include "codecs/clip_bitstream.h"
#include "codecs/clip_codec.h"

namespace batchenc {

// Motion vectors of an octree's cells, frame by frame (J. Zhang and C. Owen, "Octree-based animated geometry
// compression", 2004; D3DMC: K. Müller, A. Smolic, M. Kautzner, P. Eisert and T. Wiegand, "Predictive
// compression of dynamic 3D meshes", 2005; 2.4.2.1). docs/BASELINES.md says what is coded.

/// See encode_clip. header: of this clip. Error: kLimit.
Expected<EncodedClip> encode_octree_motion(PositionsView positions, const MeshTopology& mesh,
                                           const BaselineHeader& header, const Executor& executor);

/// See decode_clip.
Expected<std::unique_ptr<DecodedClip>> decode_octree_motion(const ClipBitstream& clip, const SharedMesh& mesh,
                                                            std::int64_t size_limit_bytes,
                                                            const Executor& executor);

}  // namespace batchenc
