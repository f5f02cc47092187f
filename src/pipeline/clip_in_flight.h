#pragma once

#include <cstdint>
#include <vector>

#include "codecs/clip_codec.h"
#include "codecs/segmentation.h"
#include "io/result_file.h"
#include "pipeline/batch_report.h"

namespace batchenc {

class JobRun;

/// One clip on its way through the graph, with what its stages leave for the next ones.
struct ClipInFlight {
    std::int64_t number = 0;     ///< in the batch, from 0
    std::size_t job_number = 0;  ///< of its job in the batch
    JobRun* job = nullptr;       ///< whose clip this is; outlives the clip
    std::int64_t index = 0;      ///< in the job, from 0
    ClipSpan span;               ///< in the job's frames
    StageSeconds seconds;        ///< wall time that the stages of this clip took

    std::vector<float> source;         ///< [f][V][3], from read
    Segmentation segmentation;         ///< from segment
    EncodedClip encoded;               ///< from code
    std::vector<float> decoded;        ///< [f][V][3], from verify
    std::vector<std::int32_t> labels;  ///< V values as decoded, from verify
    std::vector<float> vertex_rmse;    ///< V values, world units, from verify when the job wants analysis
    double decode_time_s = 0.0;        ///< from verify: decode_clip and reconstruct alone
};

}  // namespace batchenc
