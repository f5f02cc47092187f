#include <fmt/format.h>

#include "app/commands.h"
#include "app/exit_code.h"
#include "app/log.h"
#include "app/progress.h"
#include "pipeline/import_meshes.h"

namespace batchenc {

int run_command(const ImportOptions& options, const CommonOptions& common, const std::atomic<bool>& stop) {
    ImportRequest request;
    request.meshes = options.meshes;
    request.output = options.output;
    request.fps = options.fps;
    request.name = options.name.empty() ? options.output.stem().string() : options.name;
    request.overwrite = options.overwrite;

    Expected<ImportReport> report;
    {
        Progress progress(common.progress, common.log_json);
        report = import_meshes(request, stop, [&](double part) { progress.update(part); });
    }
    if (!report) {
        log_error(report.error());
        return exit_code_of(report.error());
    }
    if (report->polygon_count > 0)
        log_info(fmt::format("{} faces of more than three corners became triangles", report->polygon_count),
                 {{"event", "note"}});
    if (report->ignored_count > 0)
        log_info(fmt::format("{} faces of fewer than three corners were left out", report->ignored_count),
                 {{"event", "note"}});
    fmt::print("{}: {} frames of {} vertices and {} triangles\n", options.output.string(),
               report->frame_count, report->vertex_count, report->triangle_count);
    return kExitDone;
}

}  // namespace batchenc
