#pragma once

#include "codecs/clip_codec.h"

namespace batchenc {

// ORLPCA (6.5): RLPCA with as many components in each cluster as are worth their rate. Its stream is RLPCA's
// under a number of its own, and RLPCA's decoder reads it.

/// See encode_clip. parameters: with one of the targets kg, da, bpvf and components, which what is decoded
/// keeps. target_bpvf counts the bytes of this bitstream. The singular vectors of every cluster are taken
/// once; a target in kg, da or bpvf takes up to 12 trials, in which streams are coded, or decoded as well.
/// Further errors: kInvalidArgument (a target beyond reach, or one that the clip does not define).
Expected<EncodedClip> encode_orlpca(PositionsView positions, const MeshTopology& mesh,
                                    const Segmentation& segmentation, const CodecParameters& parameters,
                                    const Executor& executor);

}  // namespace batchenc
