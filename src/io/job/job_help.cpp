// What the table of keys tells people: ranges, defaults, and all of it as --help-job prints it.
#include <algorithm>

#include "io/job/job_schema.h"

namespace batchenc {
namespace {

std::string joined(std::span<const std::string_view> words) {
    std::string text;
    for (const std::string_view word : words) text += (text.empty() ? "" : ", ") + std::string(word);
    return text;
}

/// Text over several lines of at most 120 characters, each after `indent` blanks but the first.
std::string wrapped(std::string_view text, std::size_t indent) {
    constexpr std::size_t kWidth = 120;
    std::string lines;
    while (text.size() > kWidth - indent) {
        const std::size_t blank = text.rfind(' ', kWidth - indent);
        if (blank == std::string_view::npos) break;
        lines += std::string(text.substr(0, blank)) + "\n" + std::string(indent, ' ');
        text.remove_prefix(blank + 1);
    }
    return lines + std::string(text);
}

}  // namespace

std::string describe_range(const JobKey& key) {
    std::string text;
    switch (key.type) {
        case JobKeyType::kMapping:
            return "mapping";
        case JobKeyType::kInteger:
            text = "integer, " + std::to_string(key.low);
            if (key.high != key.low) text += " to " + std::to_string(key.high);
            if (!key.words.empty()) text += ", or " + joined(key.words);
            break;
        case JobKeyType::kNumber:
            text = "number, " + std::to_string(key.low) + " to " + std::to_string(key.high);
            break;
        case JobKeyType::kBoolean:
            return "true or false";
        case JobKeyType::kText:
            return "text";
        case JobKeyType::kPath:
            return "path, relative to the job file";
        case JobKeyType::kDataset:
            return "dataset path, from /";
        case JobKeyType::kChoice:
            text = joined(key.words);
            break;
        case JobKeyType::kFrames:
            return "[begin, end]; end may be the word end";
        case JobKeyType::kSweep:
            return "mapping of keys to lists";
    }
    return text;
}

std::string describe_default(const JobKey& key) {
    if (key.required) return "required";
    if (!key.show) return {};
    if (key.path == "name") return "file name";
    return key.show(JobDraft{});
}

std::string job_help() {
    constexpr std::size_t kIndent = 28;
    std::string help =
        "Keys of a job file. Paths are relative to the job file; * marks keys that a sweep takes.\n\n";
    for (const JobKey& key : job_keys()) {
        std::string line = (key.sweepable ? "* " : "  ") + std::string(key.path);
        line.resize(std::max<std::size_t>(line.size() + 2, kIndent), ' ');
        std::string range = describe_range(key);
        const std::string by_default = describe_default(key);
        if (by_default == "required") {
            range += "; required";
        } else if (!by_default.empty()) {
            range += "; default " + by_default;
        }
        help += line + wrapped(range, kIndent) + "\n" + std::string(kIndent, ' ') +
                wrapped(key.sentence, kIndent) + "\n";
    }
    return help;
}

}  // namespace batchenc
