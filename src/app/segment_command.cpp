#include <fmt/format.h>

#include "app/commands.h"
#include "app/exit_code.h"
#include "app/log.h"
#include "pipeline/segment_source.h"
#include "pipeline/tbb_executor.h"
#include "pipeline/threads.h"

namespace batchenc {

int run_command(const SegmentOptions& options, const CommonOptions& common, const std::atomic<bool>& stop) {
    SegmentRequest request;
    request.source = options.source;
    request.output = options.output;
    request.ply = options.ply;
    request.frame_begin = options.frames.begin;
    request.frame_end = options.frames.end;
    request.parameters = options.parameters;
    request.overwrite = options.overwrite;
    request.memory_bytes = common.memory_bytes;
    if (auto valid = check_parameters(request.parameters); !valid) {
        log_error(valid.error());
        return kExitUsage;
    }

    Expected<SegmentReport> report;
    run_with_threads(common.threads, [&] { report = segment_source(request, TbbExecutor(stop), stop); });
    if (!report) {
        log_error(report.error());
        return exit_code_of(report.error());
    }
    const Segmentation& found = report->segmentation;
    for (const std::string& note : found.notes) log_info(note, {{"event", "note"}});
    fmt::print("{}: {} clusters of {} vertices over {} frames, average deviation {:.6g}, {:.1f} ms\n",
               options.output.string(), found.cluster_count(), report->vertex_count, report->frame_count,
               found.average_deviation(), 1e3 * report->time_s);
    return kExitDone;
}

}  // namespace batchenc
