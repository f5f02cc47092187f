#include <fmt/format.h>

#include "app/commands.h"
#include "app/exit_code.h"
#include "app/log.h"
#include "app/progress.h"
#include "pipeline/export_clip.h"

namespace batchenc {

int run_command(const ExportOptions& options, const CommonOptions& common, const std::atomic<bool>& stop) {
    ExportRequest request;
    request.clip = options.clip;
    request.output = options.output;
    request.frame_begin = options.frames.begin;
    request.frame_end = options.frames.end;
    request.overwrite = options.overwrite;
    request.ascii = options.ascii;

    Expected<std::int64_t> count;
    {
        Progress progress(common.progress, common.log_json);
        count = export_clip(request, stop, [&](double part) { progress.update(part); });
    }
    if (!count) {
        log_error(count.error());
        return exit_code_of(count.error());
    }
    fmt::print("{}: {} frames\n", options.output.string(), *count);
    return kExitDone;
}

}  // namespace batchenc
