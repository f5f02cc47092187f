#pragma once

#include <memory>

#include "codecs/baselines/baseline_header.h"
#include "codecs/clip_bitstream.h"
#include "codecs/clip_codec.h"

namespace batchenc {

// Baselines that predict vertices from decoded ones, of their frame and of those before: positions are
// rounded to a lattice once, and what follows is lossless on its integers. No coordinate is farther from its
// source than half a step, and what float32 rounds away.

/// method: kBaselineStatic, kBaselineLpc, kBaselineDynapack or kBaselineAngle. header: of the positions.
/// Dynapack with `auto` codes by both of its predictors and keeps the smaller stream. See encode_clip.
Expected<EncodedClip> encode_predicted(PositionsView positions, const MeshTopology& mesh,
                                       BaselineHeader header, CodecMethod method, const Executor& executor);

/// See decode_clip. All frames are decoded at once and kept.
Expected<std::unique_ptr<DecodedClip>> decode_predicted(const ClipBitstream& clip, const SharedMesh& mesh,
                                                        std::int64_t size_limit_bytes,
                                                        const Executor& executor);

}  // namespace batchenc
