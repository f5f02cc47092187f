#include "app/progress.h"

#include <unistd.h>

#include <cstdio>

#include "app/log.h"

namespace batchenc {

Progress::Progress(const std::string& mode, bool json_log) {
    if (mode == "none")
        form_ = Form::kNone;
    else if (mode == "bar" || (mode == "auto" && !json_log && isatty(STDERR_FILENO) != 0))
        form_ = Form::kBar;
    else if (mode == "auto" && json_log)
        form_ = Form::kEvents;
    else
        form_ = Form::kPlain;
    if (form_ == Form::kBar) log_over_progress_bar();
}

Progress::~Progress() { clear(); }

void Progress::update(double fraction) {
    const int percent = static_cast<int>(fraction * 100.0);
    if (percent <= percent_) return;
    percent_ = percent;
    if (form_ == Form::kPlain) std::fprintf(stderr, "PROGRESS: %d%%\n", percent);
    if (form_ == Form::kEvents) log_info("progress", {{"event", "progress"}, {"percent", percent}});
    if (form_ == Form::kBar) {
        constexpr int kWidth = 40;
        const std::string done(static_cast<std::size_t>(percent * kWidth / 100), '#');
        std::fprintf(stderr, "\r[%-*s] %3d%%\033[K", kWidth, done.c_str(), percent);
    }
    std::fflush(stderr);
}

void Progress::clear() {
    if (form_ != Form::kBar || percent_ < 0) return;
    std::fputs("\r\033[K", stderr);
    std::fflush(stderr);
}

}  // namespace batchenc
