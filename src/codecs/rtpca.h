#pragma once

#include <memory>

#include "codecs/clip_bitstream.h"
#include "codecs/clip_codec.h"

namespace batchenc {

// RTPCA, relative trajectory PCA (beyond the thesis; cf. L. Vasa and V. Skala, "COBRA", 2009, for PCA of
// trajectories): each cluster moves rigidly along a tree of clusters; what its vertices do beside that are
// trajectories, whose principal components are coded along time (basis) and over the mesh (coefficients).
// Everything is quantised so that an error of one step d weighs alike wherever it is made.

/// See encode_clip.
Expected<EncodedClip> encode_rtpca(PositionsView positions, const MeshTopology& mesh,
                                   const Segmentation& segmentation, const CodecParameters& parameters,
                                   const Executor& executor);

/// Segments a clip for encode_rtpca into as many clusters as pay: where squared error and bits, at the step
/// that the parameters ask for or lead to, are least together. segmentation: its method is used, and its
/// count is looked for. Errors: those of segment_clip and encode_rtpca.
Expected<Segmentation> segment_for_rtpca(PositionsView positions, const MeshTopology& mesh,
                                         const SegmentationParameters& segmentation,
                                         const CodecParameters& parameters, const Executor& executor);

/// Parameters and counts from the sections of a clip coded by encode_rtpca. Errors: kCorrupt.
Expected<ClipInfo> read_rtpca_info(const ClipBitstream& clip);

/// See decode_clip. components: of all clusters together, in the order of their importance.
Expected<std::unique_ptr<DecodedClip>> decode_rtpca(const ClipBitstream& clip, const SharedMesh& mesh,
                                                    std::int32_t components, std::int64_t size_limit_bytes,
                                                    const Executor& executor);

/// All frames of a clip coded by RTPCA: F × V × 3 floats.
Expected<std::vector<float>> reconstruct_rtpca(std::span<const std::uint8_t> bitstream,
                                               const MeshTopology& mesh, const Executor& executor);

/// The payload of the residuals section that brings every vertex of a clip coded by RTPCA within a bound.
/// clip: without that section. source: F × V. bound: world units, above 0. Errors: kLimit.
Expected<std::vector<std::uint8_t>> encode_rtpca_residuals(const ClipBitstream& clip,
                                                           const MeshTopology& mesh, PositionsView source,
                                                           double bound, const Executor& executor);

}  // namespace batchenc
