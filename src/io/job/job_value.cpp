#include <charconv>
#include <utility>

#include "io/job/job_schema.h"
#include "io/source_clip.h"

namespace batchenc {
namespace {

tl::unexpected<Error> refuse(const YamlNode& node, const std::string& file, std::string message) {
    return fail(ErrorCode::kInvalidArgument, std::move(message), place_in(file, node.at));
}

const char* kind_name(YamlNode::Kind kind) {
    switch (kind) {
        case YamlNode::Kind::kNull:
            return "nothing";
        case YamlNode::Kind::kPlain:
            return "a word";
        case YamlNode::Kind::kQuoted:
            return "a text in quotes";
        case YamlNode::Kind::kSequence:
            return "a list";
        case YamlNode::Kind::kMapping:
            return "a mapping";
    }
    return "nothing";
}

JobValue text_value(std::string text) {
    return {.integer = 0, .number = 0.0, .end = {}, .text = std::move(text)};
}

bool consists_of(std::string_view text, std::string_view characters) {
    return text.find_first_not_of(characters) == std::string_view::npos;
}

/// Whether some reader of YAML takes this plain text for a number, a time, a boolean or null.
bool is_ambiguous(std::string_view text) {
    std::string lower(text);
    for (char& c : lower) {
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    }
    for (const std::string_view word : {"true", "false", "yes", "no", "on", "off", "y", "n", "null", "~", "=",
                                        "<<", ".inf", "+.inf", "-.inf", ".nan"}) {
        if (lower == word) return true;
    }
    const bool starts_like_number = consists_of(lower.substr(0, 1), "0123456789+-.");
    const bool has_digit = lower.find_first_of("0123456789") != std::string::npos;
    return starts_like_number && has_digit && consists_of(lower, "0123456789abcdefox_.:+- ");
}

/// words: what the key takes beside integers, to be named in errors.
Expected<std::int64_t> read_integer(std::string_view label, std::int64_t low, std::int64_t high,
                                    const YamlNode& node, const std::string& file,
                                    std::span<const std::string_view> words = {}) {
    const std::string range = std::to_string(low) + " to " + std::to_string(high);
    std::string or_word;
    for (const std::string_view word : words) or_word += ", or the word " + std::string(word) + ",";
    const std::string name(label);
    if (node.kind == YamlNode::Kind::kQuoted) {
        return refuse(node, file, name + " is a text in quotes; write the number without them");
    }
    if (node.kind != YamlNode::Kind::kPlain) {
        return refuse(
            node, file,
            name + " holds " + kind_name(node.kind) + " where an integer from " + range + " is wanted");
    }
    const std::string_view digits = std::string_view(node.text).substr(node.text.front() == '-' ? 1 : 0);
    if (digits.empty() || !consists_of(digits, "0123456789") || node.text == "-0") {
        return refuse(node, file,
                      name + " is " + quoted_for_message(node.text) + " where an integer from " + range +
                          " in plain decimal digits" + or_word + " is wanted");
    }
    if (digits.size() > 1 && digits.front() == '0') {
        return refuse(node, file,
                      name + " is " + quoted_for_message(node.text) +
                          ": leave the leading zero out, YAML readers disagree about it");
    }
    std::int64_t value = 0;
    const char* end = node.text.data() + node.text.size();
    const auto parsed = std::from_chars(node.text.data(), end, value);
    if (parsed.ec != std::errc{} || value < low || value > high) {
        return refuse(node, file, name + " is " + quoted_for_message(node.text) + ", outside " + range);
    }
    return value;
}

/// Perhaps a minus, digits, then perhaps a point and digits, then perhaps e, a sign and digits; nothing that
/// YAML readers take for different things.
bool is_plain_number(std::string_view text) {
    const auto digits = [&] {
        std::size_t count = 0;
        while (count < text.size() && text[count] >= '0' && text[count] <= '9') ++count;
        text.remove_prefix(count);
        return count;
    };
    if (text.starts_with('-')) text.remove_prefix(1);
    const bool zero_first = text.starts_with('0');
    const std::size_t whole = digits();
    if (whole == 0 || (zero_first && whole > 1)) return false;
    if (text.starts_with('.')) {
        text.remove_prefix(1);
        if (digits() == 0) return false;
    }
    if (text.starts_with('e')) {
        text.remove_prefix(1);
        if (text.starts_with('-') || text.starts_with('+')) text.remove_prefix(1);
        if (digits() == 0) return false;
    }
    return text.empty();
}

Expected<JobValue> read_number(const JobKey& key, const YamlNode& node, const std::string& file) {
    const std::string range = std::to_string(key.low) + " to " + std::to_string(key.high);
    const std::string name(key.path);
    if (node.kind == YamlNode::Kind::kQuoted)
        return refuse(node, file, name + " is a text in quotes; write the number without them");
    if (node.kind != YamlNode::Kind::kPlain)
        return refuse(
            node, file,
            name + " holds " + kind_name(node.kind) + " where a number from " + range + " is wanted");
    if (!is_plain_number(node.text))
        return refuse(node, file,
                      name + " is " + quoted_for_message(node.text) + " where a number from " + range +
                          ", such as 0.25 or 1e-4, is wanted");
    double value = 0.0;
    const auto parsed = std::from_chars(node.text.data(), node.text.data() + node.text.size(), value);
    if (parsed.ec != std::errc{} || value < static_cast<double>(key.low) ||
        value > static_cast<double>(key.high) || (value == 0.0 && node.text.front() == '-'))
        return refuse(node, file, name + " is " + quoted_for_message(node.text) + ", outside " + range);
    return JobValue{.integer = 0, .number = value, .end = {}, .text = {}};
}

Expected<JobValue> read_boolean(const JobKey& key, const YamlNode& node, const std::string& file) {
    if (node.kind == YamlNode::Kind::kPlain && (node.text == "true" || node.text == "false")) {
        return JobValue{.integer = node.text == "true", .number = 0.0, .end = {}, .text = {}};
    }
    return refuse(node, file, std::string(key.path) + " must be true or false, in these letters");
}

Expected<JobValue> read_text(const JobKey& key, const YamlNode& node, const std::string& file) {
    const std::string name(key.path);
    if (node.kind != YamlNode::Kind::kPlain && node.kind != YamlNode::Kind::kQuoted) {
        return refuse(node, file, name + " holds " + kind_name(node.kind) + " where a text is wanted");
    }
    if (node.kind == YamlNode::Kind::kPlain && is_ambiguous(node.text)) {
        return refuse(node, file,
                      name + " is " + quoted_for_message(node.text) +
                          ", which YAML readers may take for something else than text; put it in quotes");
    }
    if (node.text.empty()) return refuse(node, file, name + " is empty");
    if (find_unprintable(node.text, false) != node.text.size()) {
        return refuse(node, file, name + " contains a control character");
    }
    return text_value(node.text);
}

Expected<JobValue> check_name(JobValue value, const YamlNode& node, const std::string& file) {
    constexpr std::size_t kLongest = 255;  // what file systems allow for one name
    if (value.text.size() > kLongest) return refuse(node, file, "name is longer than 255 bytes");
    if (value.text.find_first_of("/\\") != std::string::npos) {
        return refuse(node, file, "name contains a slash; a name is no path");
    }
    return value;
}

Expected<JobValue> check_path(const JobKey& key, JobValue value, const YamlNode& node,
                              const std::string& file) {
    const std::string name(key.path);
    if (value.text.starts_with("~")) {
        return refuse(node, file, name + " starts with '~', which is not expanded; write the folder out");
    }
    const std::string last = std::filesystem::path(value.text).filename().string();
    if (last.empty() || last == "." || last == "..") {
        return refuse(node, file, name + " is " + quoted_for_message(value.text) + ", a folder; name a file");
    }
    return value;
}

Expected<JobValue> check_dataset(const JobKey& key, JobValue value, const YamlNode& node,
                                 const std::string& file) {
    if (value.text.front() != '/' || value.text.back() == '/') {
        return refuse(node, file,
                      std::string(key.path) + " is " + quoted_for_message(value.text) +
                          "; name a dataset from the root, such as /positions");
    }
    return value;
}

Expected<JobValue> read_choice(const JobKey& key, const YamlNode& node, const std::string& file) {
    const std::string name(key.path);
    std::string accepted;
    for (const std::string_view word : key.words)
        accepted += (accepted.empty() ? "" : ", ") + std::string(word);
    if (node.kind != YamlNode::Kind::kPlain && node.kind != YamlNode::Kind::kQuoted) {
        return refuse(node, file, name + " holds " + kind_name(node.kind) + "; accepted: " + accepted);
    }
    for (const std::string_view word : key.words) {
        if (node.text == word) return text_value(node.text);
    }
    const std::string_view near = nearest_word(node.text, key.words);
    const std::string suggestion = near.empty() ? "" : ", did you mean '" + std::string(near) + "'?";
    return refuse(node, file,
                  name + " is " + quoted_for_message(node.text) + suggestion + "; accepted: " + accepted);
}

Expected<JobValue> read_frames(const JobKey& key, const YamlNode& node, const std::string& file) {
    const std::string name(key.path);
    if (node.kind != YamlNode::Kind::kSequence || node.items.size() != 2) {
        return refuse(node, file, name + " must be [begin, end], such as [0, 100] or [100, end]");
    }
    constexpr std::int64_t kMost = SourceLimits{}.max_frames;
    const auto begin = read_integer(name + " begin", 0, kMost - 1, node.items[0], file);
    if (!begin) return tl::unexpected(begin.error());
    if (node.items[1].kind == YamlNode::Kind::kPlain && node.items[1].text == "end") {
        return JobValue{.integer = *begin, .number = 0.0, .end = {}, .text = {}};
    }
    const auto end = read_integer(name + " end", 1, kMost, node.items[1], file);
    if (!end) return tl::unexpected(end.error());
    if (*end <= *begin) {
        return refuse(
            node, file,
            name + " holds no frame: " + std::to_string(*begin) + " to before " + std::to_string(*end));
    }
    return JobValue{.integer = *begin, .number = 0.0, .end = *end, .text = {}};
}

}  // namespace

Expected<JobValue> read_value(const JobKey& key, const YamlNode& node, const std::string& file) {
    switch (key.type) {
        case JobKeyType::kInteger:
            if (node.kind == YamlNode::Kind::kPlain)
                for (const std::string_view word : key.words)
                    if (node.text == word) return text_value(node.text);
            return read_integer(key.path, key.low, key.high, node, file, key.words)
                .map([](std::int64_t value) {
                    return JobValue{.integer = value, .number = 0.0, .end = {}, .text = {}};
                });
        case JobKeyType::kNumber:
            return read_number(key, node, file);
        case JobKeyType::kBoolean:
            return read_boolean(key, node, file);
        case JobKeyType::kText:
            return read_text(key, node, file).and_then([&](JobValue v) {
                return check_name(std::move(v), node, file);
            });
        case JobKeyType::kPath:
            return read_text(key, node, file).and_then([&](JobValue v) {
                return check_path(key, std::move(v), node, file);
            });
        case JobKeyType::kDataset:
            return read_text(key, node, file).and_then([&](JobValue v) {
                return check_dataset(key, std::move(v), node, file);
            });
        case JobKeyType::kChoice:
            return read_choice(key, node, file);
        case JobKeyType::kFrames:
            return read_frames(key, node, file);
        case JobKeyType::kMapping:
        case JobKeyType::kSweep:
            break;
    }
    return fail(ErrorCode::kInternal, std::string(key.path) + " has no value of its own",
                place_in(file, node.at));
}

}  // namespace batchenc
