#include <fmt/format.h>

#include <cstdio>

#include "app/commands.h"
#include "app/exit_code.h"
#include "app/log.h"
#include "app/progress.h"
#include "pipeline/batch.h"
#include "pipeline/tbb_executor.h"
#include "pipeline/threads.h"

namespace batchenc {

namespace {

/// Every job of every file; each file that is wrong is logged, so that one run names them all.
std::optional<std::vector<Job>> read_jobs(const std::vector<std::filesystem::path>& files) {
    std::vector<Job> jobs;
    bool is_good = true;
    for (const auto& file : files) {
        auto read = read_job_file(file);
        if (read)
            std::move(read->begin(), read->end(), std::back_inserter(jobs));
        else
            log_error(read.error());
        is_good = is_good && read.has_value();
    }
    if (auto checked = check_outputs(jobs); is_good && !checked) {
        log_error(checked.error());
        is_good = false;
    }
    return is_good ? std::optional(std::move(jobs)) : std::nullopt;
}

int print_plan(const std::vector<JobPlan>& plans, const CommonOptions& common) {
    int exit_code = kExitDone;
    for (const JobPlan& plan : plans) {
        const Job& job = plan.job;
        if (plan.error) {
            log_error(plan.error->to_string(),
                      {{"event", "plan"}, {"job", job.name}, {"error", to_json(*plan.error)}});
            fmt::print("{}: cannot run\n", job.name);
            exit_code = exit_code_of(*plan.error);
            continue;
        }
        fmt::print("{}: {}\n  input   {}, {} vertices, {} triangles, {} frames from {}\n", job.name,
                   plan.kept ? "kept, the result is whole" : "to be encoded", job.input.string(),
                   plan.header.vertex_count, plan.header.triangle_count, plan.header.frame_count,
                   job.frame_begin);
        const std::string clips =
            plan.cuts_by_motion ? fmt::format("cut by motion, of {} frames at most", plan.clip_length)
                                : fmt::format("{} of {} frames", plan.even_clips().size(), plan.clip_length);
        fmt::print("  clips   {}, about {:.1f} MB in flight each\n", clips,
                   static_cast<double>(clip_memory_bytes(plan)) / 1e6);
        fmt::print("  codec   {}\n  output  {}\n", plan.header.method, job.output.string());
    }
    fmt::print("{} clips in flight at most\n", choose_tokens(plans, common.memory_bytes, common.threads));
    return exit_code;
}

nlohmann::json to_json(const StageSeconds& seconds) {
    return {{"read", seconds.read},
            {"segment", seconds.segment},
            {"code", seconds.code},
            {"verify", seconds.verify},
            {"write", seconds.write}};
}

/// A row of figures a job on stdout, its story in the log, the progress between them.
class EncodeReporter final : public BatchListener {
 public:
    explicit EncodeReporter(const CommonOptions& common) : progress_(common.progress, common.log_json) {}

    void note(const std::string& job, const std::string& text) override {
        log_info(job + ": " + text, {{"event", "note"}, {"job", job}});
    }

    void progress(double fraction) override { progress_.update(fraction); }

    void job_ended(const JobReport& report) override {
        nlohmann::json fields = {{"event", "job"}, {"job", report.name}, {"output", report.output.string()}};
        if (report.error) {
            fields["status"] = "failed";
            fields["error"] = batchenc::to_json(*report.error);
            log_error("job " + report.name + ": " + report.error->to_string(), fields);
            return;
        }
        fields["status"] = report.kept ? "kept" : "done";
        fields["raw_bytes"] = report.raw_bytes;
        fields["result_bytes"] = report.result_bytes;
        fields["seconds"] = to_json(report.seconds);
        fields["metrics"] = report.metrics.values;
        log_info("job " + report.name + (report.kept ? ": kept" : ": done"), fields);
        log_debug(
            fmt::format(
                "job {}: read {:.3f} s, segment {:.3f} s, code {:.3f} s, verify {:.3f} s, write {:.3f} s",
                report.name, report.seconds.read, report.seconds.segment, report.seconds.code,
                report.seconds.verify, report.seconds.write),
            {{"event", "stages"}, {"job", report.name}, {"seconds", to_json(report.seconds)}});
        print_row(report);
    }

 private:
    void print_row(const JobReport& report) {
        progress_.clear();
        if (!has_heading_)
            fmt::print("{:>9} {:>10} {:>10} {:>9} {:>9}  {}\n", "bpvf", "da", "kg", "ratio", "MB/s",
                       "output");
        has_heading_ = true;
        const auto value = [&](const char* name) {
            const auto found = report.metrics.values.find(name);
            return found == report.metrics.values.end() ? std::nan("") : found->second;
        };
        const double raw_bytes = static_cast<double>(report.raw_bytes);
        fmt::print("{:>9.4f} {:>10.6f} {:>10.6f} {:>9.2f} {:>9.1f}  {}\n", value("bpvf"), value("da"),
                   value("kg"), 8.0 * raw_bytes / value("bits_total"),
                   raw_bytes / value("encode_time_s") / 1e6, report.output.string());
        std::fflush(stdout);
    }

    Progress progress_;
    bool has_heading_ = false;
};

}  // namespace

int run_command(const EncodeOptions& options, const CommonOptions& common, const std::atomic<bool>& stop) {
    const auto jobs = read_jobs(options.job_files);
    if (!jobs) return kExitUsage;
    const std::vector<JobPlan> plans = plan_jobs(*jobs, options.existing, stop);
    if (options.dry_run) return print_plan(plans, common);
    for (const JobPlan& plan : plans)
        if (plan.runs() && clip_memory_bytes(plan) > common.memory_bytes)
            log_warning(
                fmt::format("job {}: a clip needs about {:.0f} MB, --memory allows {:.0f} MB; clips go one "
                            "by one, and clips.length would make them smaller",
                            plan.job.name, static_cast<double>(clip_memory_bytes(plan)) / 1e6,
                            static_cast<double>(common.memory_bytes) / 1e6),
                {{"event", "memory"}, {"job", plan.job.name}});

    BatchReport report;
    run_with_threads(common.threads, [&] {
        EncodeReporter reporter(common);
        report = run_batch(plans, {common.memory_bytes, common.threads}, TbbExecutor(stop), stop, reporter);
    });

    std::size_t failed = 0;
    for (const JobReport& job : report.jobs) failed += job.error.has_value();
    const auto count = report.jobs.size();
    if (failed > 0)
        log_error(fmt::format("jobs failed: {} of {}", failed, count),
                  {{"event", "batch"}, {"jobs", count}, {"failed", failed}});
    else
        log_info(fmt::format("jobs done: {}", count), {{"event", "batch"}, {"jobs", count}, {"failed", 0}});
    if (report.interrupted()) return kExitInterrupted;
    return failed > 0 ? kExitFailed : kExitDone;
}

}  // namespace batchenc
