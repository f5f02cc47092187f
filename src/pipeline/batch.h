#pragma once

#include <atomic>
#include <string>
#include <vector>

#include "core/executor.h"
#include "pipeline/batch_report.h"
#include "pipeline/plan.h"

namespace batchenc {

/// Hears how a batch goes. Calls come from several threads, one at a time; they must be quick and not throw.
class BatchListener {
 public:
    virtual ~BatchListener() = default;
    /// What a user should know about a job that goes on.
    virtual void note(const std::string& job, const std::string& text) = 0;
    /// The job is done, kept or failed.
    virtual void job_ended(const JobReport& report) = 0;
    /// Part of the batch' work that is done, never falling: clips weigh their raw bytes, the five stages
    /// alike.
    virtual void progress(double fraction) = 0;
};

struct BatchOptions {
    std::int64_t memory_bytes = 0;  ///< for clips in flight
    int threads = 1;                ///< that run it; with the memory it decides how many clips are in flight
};

/// Encodes every job of the plans that runs. Clips of several jobs are in flight together; a failed job is
/// reported and the others go on. The bytes of the results depend neither on the executor nor on the threads.
///
/// stop: once it is true, jobs that are not finished end with kInterrupted and leave nothing behind.
BatchReport run_batch(const std::vector<JobPlan>& plans, const BatchOptions& options,
                      const Executor& executor, const std::atomic<bool>& stop, BatchListener& listener);

}  // namespace batchenc
