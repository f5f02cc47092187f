#pragma once

#include <cstdint>
#include <span>

#include "kernels/local_frame.h"
#include "kernels/vertex_block.h"

namespace batchenc {

/// Adds to theta of one block of vertices in one cluster (4.1) what frames [begin, end) give:
///   theta_{k,i} = sum over f of | q_k^{i,f} - q_k^{i,f-1} |^2,  q = T_i^f (p - o_i^f).
/// This is the N × F × V local-frame transform that dominates segmentation. q stays in registers. SIMD with
/// run-time dispatch, float32, 27 operations a vertex, frame and cluster. Theta of all frames has the same
/// bits only where it is summed in the same runs of frames.
///
/// block: frames of a vertex block from 0 to end at least, on a 64-byte boundary. begin: at least 1.
/// theta: kVertexBlock sums, world units squared, anywhere.
void add_deviation(const float* block, std::int64_t begin, std::int64_t end, const LocalFrameTrack& track,
                   float* theta);

/// Frames that one call of add_deviation should take where theta is wanted in runs: such a run of a block,
/// 18 KiB, stays in L1 while all clusters pass over it.
inline constexpr std::int64_t kDeviationRun = 48;

/// Theta of one block of vertices in every cluster, all frames.
///
/// block: F frames of a vertex block. tracks: N tracks of F frames. theta: N × kVertexBlock, cluster by
/// cluster, world units squared, overwritten.
void deviation_block(const float* block, std::int64_t frame_count, std::span<const LocalFrameTrack> tracks,
                     std::span<float> theta);

/// Floating-point operations of deviation_block for a whole clip, for benchmarks.
double deviation_flop(std::int64_t frames, std::int64_t vertices, std::int64_t clusters);

}  // namespace batchenc
