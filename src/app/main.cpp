#include <cstdio>
#include <exception>

#include "app/command_line.h"
#include "app/commands.h"
#include "app/exit_code.h"
#include "app/log.h"
#include "app/stop_signal.h"
#include "pipeline/blas_guard.h"

namespace {

using namespace batchenc;

int run(int argc, char** argv) {
    const auto blas = guard_blas(argv);  // first of all: it may start the program again
    const auto parsed = parse_command_line(argc, argv);
    if (const int* exit_code = std::get_if<int>(&parsed)) return *exit_code;
    const CommandLine& line = std::get<CommandLine>(parsed);

    start_log(line.common.log_level, line.common.log_json);
    if (!blas) {
        log_error(blas.error());
        return kExitFailed;
    }
    if (std::holds_alternative<EncodeOptions>(line.command)) log_info(*blas, {{"event", "blas"}});
    const auto& stop = install_stop_signals();
    int exit_code = std::visit([&](const auto& command) { return run_command(command, line.common, stop); },
                               line.command);
    if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0) {
        log_error("stdout cannot be written to");
        if (exit_code == kExitDone) exit_code = kExitFailed;
    }
    return exit_code;
}

}  // namespace

int main(int argc, char** argv) {
    try {
        return run(argc, argv);
    } catch (const std::exception& exception) {
        std::fprintf(stderr, "batchenc: %s\n", exception.what());
        return kExitFailed;
    }
}
