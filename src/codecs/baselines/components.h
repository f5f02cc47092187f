#pragma once

#include <memory>

#include "codecs/baselines/baseline_header.h"
#include "codecs/clip_bitstream.h"
#include "codecs/clip_codec.h"

namespace batchenc {

// baseline-pca, baseline-pca-lpc and baseline-cpca: shapes of a whole clip or of its clusters by principal
// components, as RLPCA has them (codecs/component_clusters.h).

/// See encode_clip; parameters.method is one of the three.
Expected<EncodedClip> encode_component_baseline(PositionsView positions, const MeshTopology& mesh,
                                                const Segmentation& segmentation,
                                                const CodecParameters& parameters, BaselineHeader header,
                                                const Executor& executor);

/// See decode_clip.
Expected<std::unique_ptr<DecodedClip>> decode_component_baseline(const ClipBitstream& clip,
                                                                 const SharedMesh& mesh,
                                                                 std::int32_t components,
                                                                 std::int64_t size_limit_bytes,
                                                                 const Executor& executor);

}  // namespace batchenc
