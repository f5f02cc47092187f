#pragma once

#include <string>

namespace batchenc {

/// Shows on stderr how far the work is: a bar on a terminal, lines `PROGRESS: 42%` that farm managers read
/// elsewhere, or JSON events in a JSON log. One thread at a time.
class Progress {
 public:
    /// mode: "auto", "bar", "plain" or "none"; auto is a bar on a terminal, events in a JSON log, else plain.
    Progress(const std::string& mode, bool json_log);
    ~Progress();
    Progress(const Progress&) = delete;
    Progress& operator=(const Progress&) = delete;

    /// fraction: 0 … 1, not falling. Shows at most one step a percent.
    void update(double fraction);
    /// Wipes the bar, so that something else can be printed on its line; the next update draws it again.
    void clear();

 private:
    enum class Form { kBar, kPlain, kEvents, kNone };

    Form form_;
    int percent_ = -1;
};

}  // namespace batchenc
