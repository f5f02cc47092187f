#pragma once

#include <cstdint>

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

/// What goes into /metrics (docs/RESULTS.md names every value): rates in bits, distortion, times in seconds.
/// vertex_count, frame_count: at least 1.
ResultMetrics make_result_metrics(const ResultBytes& bytes, const ErrorMetrics& errors,
                                  std::int64_t vertex_count, std::int64_t frame_count, double encode_time_s,
                                  double decode_time_s);

}  // namespace batchenc
