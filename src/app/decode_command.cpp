#include <fmt/format.h>

#include "app/commands.h"
#include "app/exit_code.h"
#include "app/log.h"
#include "app/progress.h"
#include "pipeline/decode_result.h"
#include "pipeline/tbb_executor.h"
#include "pipeline/threads.h"

namespace batchenc {

int run_command(const DecodeOptions& options, const CommonOptions& common, const std::atomic<bool>& stop) {
    DecodeRequest request;
    request.result = options.result;
    request.output = options.output;
    request.frame_begin = options.frames.begin;
    request.frame_end = options.frames.end;
    request.components = options.components;
    request.overwrite = options.overwrite;
    request.memory_bytes = common.memory_bytes;

    Expected<DecodeReport> report;
    run_with_threads(common.threads, [&] {
        Progress progress(common.progress, common.log_json);
        report = decode_result(request, TbbExecutor(stop), stop, [&](double part) { progress.update(part); });
    });
    if (!report) {
        log_error(report.error());
        return exit_code_of(report.error());
    }
    const double bytes =
        12.0 * static_cast<double>(report->vertex_count) * static_cast<double>(report->frame_count);
    fmt::print("{}: {} frames of {} vertices and {} triangles, {:.1f} MB/s\n", options.output.string(),
               report->frame_count, report->vertex_count, report->triangle_count,
               bytes / report->time_s / 1e6);
    return kExitDone;
}

}  // namespace batchenc
