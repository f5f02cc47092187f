#pragma once

#include <memory>

#include "codecs/clip_bitstream.h"
#include "codecs/clip_codec.h"

namespace batchenc {

// RLPCA and LPCA (chapter 6): per cluster the leading singular vectors of its vertices' local coordinates
// over time, min-max quantised, the LCFs from seed triangles on a lattice. `space: world` leaves the LCFs
// out; with one cluster it is the global PCA.

/// See encode_clip.
Expected<EncodedClip> encode_rlpca(PositionsView positions, const MeshTopology& mesh,
                                   const Segmentation& segmentation, const CodecParameters& parameters,
                                   const Executor& executor);

// Clips of ORLPCA (codecs/orlpca.h) are read by the same functions.

/// Parameters and counts from the sections of a clip coded by encode_rlpca. Errors: kCorrupt.
Expected<ClipInfo> read_rlpca_info(const ClipBitstream& clip);

/// See decode_clip. mesh: not held on to.
Expected<std::unique_ptr<DecodedClip>> decode_rlpca(const ClipBitstream& clip, const MeshTopology& mesh,
                                                    std::int32_t components, std::int64_t size_limit_bytes,
                                                    const Executor& executor);

}  // namespace batchenc
