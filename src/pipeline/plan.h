#pragma once

#include <atomic>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/error.h"
#include "io/job_file.h"
#include "io/result_file.h"

namespace batchenc {

/// What to do with an output that exists already.
enum class ExistingOutput {
    kRefuse,   ///< the job fails with kExists before any work
    kResume,   ///< a whole result of the same job and a source of the same shape is kept; others are replaced
    kReplace,  ///< replaced
};

/// A job after a look at its source: what is to be written, or why it cannot be.
struct JobPlan {
    Job job;
    ResultHeader header;           ///< of the result; its frame_count is that of the job's frame range
    std::int64_t clip_length = 1;  ///< frames of every clip but perhaps the last; of cuts_by_motion, at most
    bool cuts_by_motion = false;   ///< clips are known once the job begins (pipeline/clip_cutting.h)
    bool overwrite = false;        ///< the result may take the place of an existing file
    std::optional<ResultMetrics>
        kept;                    ///< of the existing result, where that is kept: there is nothing to do
    std::optional<Error> error;  ///< the job cannot run

    /// There is work to be done.
    bool runs() const { return !error && !kept; }
    /// Clips of clip_length frames, the last with what is left, in the job's frames.
    std::vector<ClipSpan> even_clips() const;
    /// Positions as float32: 12 x V x F.
    std::int64_t raw_bytes() const { return 12 * header.vertex_count * header.frame_count; }
};

/// Refuses jobs that would write the same file, or over the input of any of them (kInvalidArgument, `where`
/// is the job file). Links and different spellings of a path are seen through.
Expected<void> check_outputs(const std::vector<Job>& jobs);

/// Opens the source of each job and looks at its output. What is wrong with a job stands in JobPlan::error;
/// after `stop`, kInterrupted in those that are left.
std::vector<JobPlan> plan_jobs(const std::vector<Job>& jobs, ExistingOutput existing,
                               const std::atomic<bool>& stop);

/// Bytes that the largest clip of the plan needs from the beginning of its reading to the end of its writing,
/// estimated; what its job keeps while it is open is counted in.
std::int64_t clip_memory_bytes(const JobPlan& plan);

/// Clips that may be in flight together: as many as fit into memory_bytes, at least 1 and at most two a
/// thread. Jobs that do not run are not counted.
int choose_tokens(const std::vector<JobPlan>& plans, std::int64_t memory_bytes, int threads);

}  // namespace batchenc
