#pragma once

#include <cstdint>
#include <span>

#include "codecs/clip_codec.h"
#include "io/result_file.h"
#include "kernels/error_metrics.h"

namespace batchenc {

/// Bytes of a whole result that its decoder reads.
struct ResultBytes {
    std::int64_t connectivity = 0;  ///< of the connectivity bitstream, order included
    std::int64_t order = 0;         ///< of `connectivity`, those spent on vertex and triangle order
    SectionBytes clips;             ///< summed over the clips
};

/// How far the errors move from frame to frame (/metrics/frame_jump): where two clips meet, and inside clips.
struct SeamJumps {
    double seam_max = 0.0;  ///< world units; 0 without seams
    double seam_mean = 0.0;
    double inner_max = 0.0;
    double inner_mean = 0.0;
};

/// frame_jump: F values, world units. clips: without gaps, from 0 to F.
SeamJumps find_seam_jumps(std::span<const double> frame_jump, std::span<const ClipSpan> clips);

/// What goes into /metrics (docs/RESULTS.md names every value): rates in bits, distortion, times in seconds.
/// clips: of the whole result. vertex_count, frame_count: at least 1.
ResultMetrics make_result_metrics(const ResultBytes& bytes, const ErrorMetrics& errors,
                                  std::span<const ClipSpan> clips, std::int64_t vertex_count,
                                  std::int64_t frame_count, double encode_time_s, double decode_time_s);

}  // namespace batchenc
