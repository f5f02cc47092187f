#pragma once

#include <cstdint>
#include <span>

#include "kernels/local_frame.h"
#include "kernels/vertex_block.h"

namespace batchenc {

/// Rows of kVertexBlock floats that variation_block gives for each cluster.
enum VariationRow : std::int64_t { kVariation, kMeanX, kMeanY, kMeanZ, kVariationRows };

/// How much the vertices of one block vary about their mean place in the frames of every cluster:
///   sum over f of | q_k^{i,f} - mean over f of q_k^{i,f} |^2,  q = T_i^f (p - o_i^f),
/// the measure of rigid-frame refinement. Sums are taken of q - q^1, which is small where it matters. SIMD
/// with run-time dispatch, float32, 30 operations a vertex, frame and cluster.
///
/// block: F frames of a vertex block. tracks: N tracks of F frames. rows: N × kVariationRows × kVertexBlock:
/// the variation, world units squared, and the mean of q, world units; overwritten.
void variation_block(const float* block, std::int64_t frame_count, std::span<const LocalFrameTrack> tracks,
                     std::span<float> rows);

}  // namespace batchenc
