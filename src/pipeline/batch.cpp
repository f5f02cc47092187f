#include "pipeline/batch.h"

#include <algorithm>
#include <mutex>

#include "pipeline/clip_graph.h"
#include "pipeline/guarded.h"
#include "pipeline/job_run.h"

namespace batchenc {

bool BatchReport::all_done() const {
    return std::none_of(jobs.begin(), jobs.end(), [](const JobReport& job) { return job.error.has_value(); });
}

bool BatchReport::interrupted() const {
    return std::any_of(jobs.begin(), jobs.end(), [](const JobReport& job) {
        return job.error && job.error->code == ErrorCode::kInterrupted;
    });
}

namespace {

constexpr int kStages = 5;

/// The report of a job whose plan leaves nothing to be done.
JobReport report_without_work(const JobPlan& plan) {
    JobReport report;
    report.name = plan.job.name;
    report.output = plan.job.output;
    report.error = plan.error;
    if (plan.kept) {
        report.kept = true;
        report.metrics = *plan.kept;
        report.raw_bytes = plan.raw_bytes();
        std::error_code ignored;  // only a figure for the report
        const auto size = std::filesystem::file_size(report.output, ignored);
        report.result_bytes = ignored ? 0 : static_cast<std::int64_t>(size);
    }
    return report;
}

/// A batch while it runs: feeds the graph, keeps each stage's outcome with its job, tells the listener.
class Batch {
 public:
    Batch(const std::vector<JobPlan>& plans, const BatchOptions& options, const Executor& executor,
          const std::atomic<bool>& stop, BatchListener& listener)
        : plans_(plans), options_(options), executor_(executor), stop_(stop), listener_(listener) {
        report_.jobs.resize(plans.size());
        runs_.resize(plans.size());
        ended_.resize(plans.size(), false);
        for (const JobPlan& plan : plans)
            if (plan.runs()) work_bytes_ += (kStages + (plan.cuts_by_motion ? 1 : 0)) * plan.raw_bytes();
    }

    BatchReport run() {
        for (std::size_t i = 0; i < plans_.size(); ++i)
            if (!plans_[i].runs()) end_job(i, report_without_work(plans_[i]));
        ClipStages stages;
        stages.next = [this] { return next_clip(); };
        stages.read = [this](ClipInFlight& clip) { run_stage(clip, &JobRun::read, &StageSeconds::read); };
        stages.segment = [this](ClipInFlight& clip) {
            run_stage(clip, &JobRun::segment, &StageSeconds::segment);
        };
        stages.code = [this](ClipInFlight& clip) { run_stage(clip, &JobRun::code, &StageSeconds::code); };
        stages.verify = [this](ClipInFlight& clip) {
            run_stage(clip, &JobRun::verify, &StageSeconds::verify);
        };
        stages.write = [this](ClipInFlight& clip) {
            run_stage(clip, &JobRun::write, &StageSeconds::write);
            end_clip(clip);
        };
        run_clip_graph(stages, choose_tokens(plans_, options_.memory_bytes, options_.threads));
        end_unfinished_jobs();
        if (!report_.interrupted()) listener_.progress(1.0);
        return std::move(report_);
    }

 private:
    using Stage = Expected<void> (JobRun::*)(ClipInFlight&);

    /// Clips of all jobs in order. A job begins with its first clip, so that only jobs in flight hold memory.
    std::shared_ptr<ClipInFlight> next_clip() {
        while (job_ < plans_.size() && (!plans_[job_].runs() || index_ == clip_count_)) {
            ++job_;
            index_ = 0;
            clip_count_ = -1;
        }
        if (job_ == plans_.size() || stop_.load(std::memory_order_relaxed)) return nullptr;
        auto clip = std::make_shared<ClipInFlight>();
        if (index_ == 0) begin_job(*clip);
        clip->number = number_++;
        clip->job_number = job_;
        clip->job = runs_[job_].get();
        clip->index = index_;
        clip->span = clip->job->clips()[static_cast<std::size_t>(index_++)];
        return clip;
    }

    /// Where the job's clips are depends on its motion, a pass over its source finds that out; what it takes
    /// is the first clip's reading.
    void begin_job(ClipInFlight& first) {
        const Stopwatch watch;
        const JobPlan& plan = plans_[job_];
        runs_[job_] = std::make_unique<JobRun>(plan, executor_);
        JobRun& job = *runs_[job_];
        if (const auto cut = job.cut(stop_); !cut) job.record_failure(cut.error());
        clip_count_ = static_cast<std::int64_t>(job.clips().size());
        first.seconds.read = watch.seconds();
        if (plan.cuts_by_motion) add_progress(plan.raw_bytes());
    }

    void run_stage(ClipInFlight& clip, Stage stage, double StageSeconds::*seconds) {
        JobRun& job = *clip.job;
        const Stopwatch watch;
        if (!job.failed()) {
            const auto done = guarded(stop_, [&] { return (job.*stage)(clip); });
            if (!done) job.record_failure(done.error());
        }
        clip.seconds.*seconds += watch.seconds();
        add_progress(12 * job.plan().header.vertex_count * clip.span.frame_count);
    }

    void add_progress(std::int64_t bytes) {
        const std::lock_guard lock(listener_mutex_);
        done_bytes_ += bytes;
        listener_.progress(static_cast<double>(done_bytes_) / static_cast<double>(work_bytes_));
    }

    void end_clip(ClipInFlight& clip) {
        JobRun& job = *clip.job;
        job.add_seconds(clip.seconds);
        for (const std::string& note : clip.segmentation.notes) {
            const std::lock_guard lock(listener_mutex_);
            listener_.note(job.plan().job.name, "clip " + std::to_string(clip.index) + ": " + note);
        }
        const bool is_last = clip.index + 1 == static_cast<std::int64_t>(job.clips().size());
        const std::size_t job_number = clip.job_number;
        clip = ClipInFlight{};  // the graph may still refer to this object: what is large is freed now
        if (is_last) end_job(job_number, job.close());
    }

    void end_unfinished_jobs() {
        for (std::size_t i = 0; i < plans_.size(); ++i) {
            if (!plans_[i].runs() || ended_[i]) continue;
            if (!runs_[i]) runs_[i] = std::make_unique<JobRun>(plans_[i], executor_);
            runs_[i]->record_failure({ErrorCode::kInterrupted, "stopped on request", {}});
            end_job(i, runs_[i]->close());
        }
    }

    void end_job(std::size_t i, JobReport report) {
        runs_[i].reset();
        ended_[i] = true;
        const std::lock_guard lock(listener_mutex_);
        listener_.job_ended(report);
        report_.jobs[i] = std::move(report);
    }

    const std::vector<JobPlan>& plans_;
    const BatchOptions& options_;
    const Executor& executor_;
    const std::atomic<bool>& stop_;

    std::size_t job_ = 0;           // next_clip: whose clip comes next
    std::int64_t index_ = 0;        // next_clip: which of its clips
    std::int64_t clip_count_ = -1;  // next_clip: how many it has, once it has begun
    std::int64_t number_ = 0;       // next_clip: clips given so far

    std::vector<std::unique_ptr<JobRun>> runs_;  // of the jobs in flight, by job number
    std::vector<bool> ended_;
    BatchReport report_;

    std::mutex listener_mutex_;  // guards what follows
    BatchListener& listener_;
    std::int64_t work_bytes_ = 0;
    std::int64_t done_bytes_ = 0;
};

}  // namespace

BatchReport run_batch(const std::vector<JobPlan>& plans, const BatchOptions& options,
                      const Executor& executor, const std::atomic<bool>& stop, BatchListener& listener) {
    return Batch(plans, options, executor, stop, listener).run();
}

}  // namespace batchenc
