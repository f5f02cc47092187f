#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "codecs/connectivity_bitstream.h"
#include "core/executor.h"
#include "io/result_file.h"
#include "io/source_clip.h"
#include "kernels/error_metrics.h"
#include "pipeline/clip_in_flight.h"
#include "pipeline/plan.h"
#include "pipeline/result_metrics.h"
#include "pipeline/stopwatch.h"

namespace batchenc {

/// One job while it runs: its source, its result, and the five stages that each of its clips goes through.
/// read is called for one clip at a time; write for one clip at a time and in order; the others for any
/// number of clips at once. A stage is not called for a clip whose earlier stage failed.
class JobRun {
 public:
    /// plan: one that runs. Both outlive the object.
    JobRun(const JobPlan& plan, const Executor& executor)
        : plan_(plan), codec_(plan.job.codec), executor_(executor) {}

    const JobPlan& plan() const { return plan_; }

    /// Finds the clips: once, before any stage. Where they are cut by motion, that reads the whole source.
    /// After an error there is one clip, for which no stage does anything.
    Expected<void> cut(const std::atomic<bool>& stop);
    /// Where the clips lie, in the job's frames; after cut.
    const std::vector<ClipSpan>& clips() const { return clips_; }

    /// Frames of the clip into clip.source; for the first clip, opens source and result.
    Expected<void> read(ClipInFlight& clip);
    Expected<void> segment(ClipInFlight& clip);
    /// Codes the clip; with the first one, the connectivity.
    Expected<void> code(ClipInFlight& clip);
    /// Decodes the bytes that will be written, into clip.decoded; with the first clip, the connectivity.
    Expected<void> verify(ClipInFlight& clip);
    /// Measures the decoded clip and writes its bytes; after the last clip, finishes the result.
    Expected<void> write(ClipInFlight& clip);

    /// Records what stopped the job; the first call counts. Any thread.
    void record_failure(Error error);
    bool failed() const { return failed_.load(std::memory_order_acquire); }

    /// Adds the times of one of its clips; one call at a time.
    void add_seconds(const StageSeconds& seconds) { seconds_ += seconds; }

    /// Ends the job: without a finished result, what was written is removed. Frees everything that was held.
    /// No stage may run any more.
    JobReport close();

 private:
    Expected<void> share_target(const std::atomic<bool>& stop);
    Expected<void> open();
    Expected<void> take_connectivity_off_target();
    Expected<void> code_connectivity();
    Expected<void> verify_connectivity() const;
    Expected<void> verify_positions(ClipInFlight& clip);
    Expected<void> check_target() const;
    Expected<void> finish();

    const JobPlan& plan_;
    CodecParameters codec_;  // the job's; with the target as it is for one clip
    const Executor& executor_;

    std::vector<ClipSpan> clips_;
    double cut_time_s_ = 0.0;
    Stopwatch since_first_read_;
    std::unique_ptr<SourceClip> source_;
    std::unique_ptr<ResultWriter> writer_;
    SharedMesh mesh_;
    std::vector<std::int32_t> source_vertices_;  // of each vertex, where their order is free; else none
    ConnectivityBitstream connectivity_;
    std::optional<ErrorMeter> meter_;
    ResultBytes bytes_;
    StageSeconds seconds_;
    double decode_time_s_ = 0.0;
    ResultMetrics metrics_;

    std::atomic<bool> failed_ = false;
    std::mutex error_mutex_;
    std::optional<Error> error_;
};

}  // namespace batchenc
