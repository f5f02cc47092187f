#pragma once

#include <cstdint>
#include <span>

#include "core/mesh_sequence.h"
#include "kernels/local_frame.h"

namespace batchenc {

/// Vertices that the deviation kernel treats together.
inline constexpr std::int64_t kDeviationBlock = 32;

/// The deviation of clustering for one block of vertices and every cluster (4.1):
///   theta_{k,i} = sum over f of | q_k^{i,f} - q_k^{i,f-1} |^2,  q = T_i^f (p - o_i^f).
/// This is the N × F × V local-frame transform that dominates segmentation. Coordinates are laid out as
/// structure of arrays in cache-sized runs of frames; q stays in registers. SIMD with run-time dispatch,
/// float32, 27 operations a vertex, frame and cluster.
///
/// positions: F × V. first_vertex: start of the block, which ends after kDeviationBlock vertices or at V.
/// tracks: N tracks of F frames. theta: N × kDeviationBlock, cluster by cluster, overwritten; entries beyond
/// V are unspecified. scratch: at least deviation_scratch_size() floats.
void deviation_block(PositionsView positions, std::int64_t first_vertex,
                     std::span<const LocalFrameTrack> tracks, std::span<float> theta,
                     std::span<float> scratch);

/// Floats of scratch memory that deviation_block needs.
std::int64_t deviation_scratch_size();

/// Floating-point operations of deviation_block for a whole clip, for benchmarks.
double deviation_flop(std::int64_t frames, std::int64_t vertices, std::int64_t clusters);

}  // namespace batchenc
