#include <fmt/format.h>

#include "app/commands.h"
#include "app/exit_code.h"
#include "app/log.h"
#include "app/progress.h"
#include "pipeline/tbb_executor.h"
#include "pipeline/threads.h"
#include "pipeline/verify_result.h"

namespace batchenc {

int run_command(const VerifyOptions& options, const CommonOptions& common, const std::atomic<bool>& stop) {
    Expected<VerifyReport> report;
    run_with_threads(common.threads, [&] {
        Progress progress(common.progress, common.log_json);
        report = verify_result(options.result, options.source, common.memory_bytes, TbbExecutor(stop), stop,
                               [&](double part) { progress.update(part); });
    });
    if (!report) {
        log_error(report.error());
        return exit_code_of(report.error());
    }
    fmt::print("{:<20} {:>18} {:>18}\n", "", "recorded", "measured");
    for (const VerifiedFigure& figure : report->figures) {
        if (figure.is_recorded)
            fmt::print("{:<20} {:>18.10g} {:>18.10g}  {}\n", figure.name, figure.recorded, figure.measured,
                       figure.agrees ? "agrees" : "DIFFERS");
        else
            fmt::print("{:<20} {:>18} {:>18.10g}\n", figure.name, "-", figure.measured);
    }
    fmt::print("{:<20} {:>18} {:>18}  {}\n", "triangles", "", "",
               report->same_triangles ? "agree" : "DIFFER");
    if (report->agrees()) return kExitDone;
    log_error({ErrorCode::kVerification, "the result does not hold what it says of this source",
               options.result.string()});
    return kExitFailed;
}

}  // namespace batchenc
