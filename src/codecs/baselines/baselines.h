#pragma once

#include <memory>

#include "codecs/clip_bitstream.h"
#include "codecs/clip_codec.h"

namespace batchenc {

// Coders that others have published, to be compared with (docs/BASELINES.md says of each what it is, where it
// departs from its source, and what stands in its sections). They share this program's kernels, containers
// and entropy coder, so that what differs between streams is the method.

/// See encode_clip; for the methods of which is_baseline() is true.
Expected<EncodedClip> encode_baseline(PositionsView positions, const MeshTopology& mesh,
                                      const Segmentation& segmentation, const CodecParameters& parameters,
                                      const Executor& executor);

/// Parameters and counts from the sections of a baseline's clip. Errors: kCorrupt.
Expected<ClipInfo> read_baseline_info(const ClipBitstream& clip);

/// See decode_clip. components: of coders by PCA; others decode all.
Expected<std::unique_ptr<DecodedClip>> decode_baseline(const ClipBitstream& clip, const SharedMesh& mesh,
                                                       std::int32_t components, std::int64_t size_limit_bytes,
                                                       const Executor& executor);

}  // namespace batchenc
