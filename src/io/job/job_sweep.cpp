#include "io/job/job_sweep.h"

#include <algorithm>

namespace batchenc {
namespace {

std::string sweepable_keys() {
    std::string list;
    for (const JobKey& key : job_keys()) {
        if (key.sweepable) list += (list.empty() ? "" : ", ") + std::string(key.path);
    }
    return list;
}

Expected<const JobKey*> find_sweepable(const YamlEntry& entry, const std::string& file) {
    const JobKey* key = find_job_key(entry.key);
    if (key && key->sweepable) return key;
    std::string message = "a sweep does not take " + quoted_for_message(entry.key);
    std::vector<std::string_view> paths;
    for (const JobKey& known : job_keys()) {
        if (!known.sweepable) continue;
        paths.push_back(known.path);
        if (known.path.ends_with("." + entry.key)) {
            message += "; did you mean '" + std::string(known.path) + "'?";
            return fail(ErrorCode::kInvalidArgument, message, place_in(file, entry.at));
        }
    }
    const std::string_view near = key ? std::string_view() : nearest_word(entry.key, paths);
    message +=
        near.empty() ? "; it takes " + sweepable_keys() : "; did you mean '" + std::string(near) + "'?";
    return fail(ErrorCode::kInvalidArgument, message, place_in(file, entry.at));
}

Expected<SweepAxis> read_axis(const YamlEntry& entry, const std::string& file) {
    const auto key = find_sweepable(entry, file);
    if (!key) return tl::unexpected(key.error());
    const auto& items = entry.value.items;
    if (entry.value.kind != YamlNode::Kind::kSequence || items.empty()) {
        return fail(ErrorCode::kInvalidArgument, "sweep of " + entry.key + " must be a list such as [5, 10]",
                    place_in(file, entry.value.at));
    }
    if (items.size() > static_cast<std::size_t>(kMaxSweepJobs)) {
        return fail(ErrorCode::kLimit,
                    "sweep of " + entry.key + " has more than " + std::to_string(kMaxSweepJobs) + " values",
                    place_in(file, entry.value.at));
    }
    SweepAxis axis;
    axis.key = *key;
    std::vector<std::string_view> seen;
    for (const YamlNode& item : items) {
        auto value = read_value(**key, item, file);
        if (!value) return tl::unexpected(value.error());
        if (std::find(seen.begin(), seen.end(), item.text) != seen.end()) {
            return fail(ErrorCode::kInvalidArgument,
                        "sweep of " + entry.key + " has " + quoted_for_message(item.text) + " twice",
                        place_in(file, item.at));
        }
        seen.push_back(item.text);
        axis.values.push_back(std::move(*value));
        axis.places.push_back(item.at);
    }
    return axis;
}

std::ptrdiff_t level_count(const JobKey& key) { return std::count(key.path.begin(), key.path.end(), '.'); }

}  // namespace

Expected<std::vector<SweepAxis>> read_sweep(const YamlNode& node, const std::string& file) {
    if (node.kind != YamlNode::Kind::kMapping || node.entries.empty()) {
        return fail(ErrorCode::kInvalidArgument,
                    "sweep must be a mapping of keys to lists, such as {codec.components: [5, 10]}",
                    place_in(file, node.at));
    }
    std::vector<SweepAxis> axes;
    for (const YamlEntry& entry : node.entries) {
        auto axis = read_axis(entry, file);
        if (!axis) return tl::unexpected(axis.error());
        axes.push_back(std::move(*axis));
        if (sweep_size(axes) > kMaxSweepJobs) {
            return fail(ErrorCode::kLimit,
                        "the sweep has more than " + std::to_string(kMaxSweepJobs) + " combinations",
                        place_in(file, node.at));
        }
    }
    return axes;
}

std::int64_t sweep_size(const std::vector<SweepAxis>& axes) {
    std::int64_t size = 1;
    for (const SweepAxis& axis : axes) size *= static_cast<std::int64_t>(axis.values.size());
    return size;
}

std::vector<std::size_t> sweep_choice(const std::vector<SweepAxis>& axes, std::int64_t number) {
    std::vector<std::size_t> choice(axes.size());
    for (std::size_t a = axes.size(); a-- > 0;) {
        const auto count = static_cast<std::int64_t>(axes[a].values.size());
        choice[a] = static_cast<std::size_t>(number % count);
        number /= count;
    }
    return choice;
}

Expected<std::string> fill_placeholders(std::string_view pattern, const JobDraft& draft) {
    std::string filled;
    while (true) {
        const std::size_t brace = pattern.find_first_of("{}");
        filled += pattern.substr(0, brace);
        if (brace == std::string_view::npos) return filled;
        const std::size_t end = pattern.find_first_of("{}", brace + 1);
        if (pattern[brace] == '}' || end == std::string_view::npos || pattern[end] == '{') {
            return fail(ErrorCode::kInvalidArgument, "a brace without its partner");
        }
        const std::string word(pattern.substr(brace + 1, end - brace - 1));
        const JobKey *match = nullptr, *equal = nullptr;  // equal: of as few levels as the match
        for (const JobKey& key : job_keys()) {
            if (!key.sweepable || (key.path != word && !key.path.ends_with("." + word))) continue;
            const auto levels = match ? level_count(key) <=> level_count(*match) : std::strong_ordering::less;
            if (levels < 0) match = &key;
            if (levels <= 0) equal = levels == 0 ? &key : nullptr;
        }
        if (equal) {
            return fail(ErrorCode::kInvalidArgument, "{" + word + "} may be {" + std::string(match->path) +
                                                         "} or {" + std::string(equal->path) +
                                                         "}; write the one you mean");
        }
        if (!match) {
            return fail(ErrorCode::kInvalidArgument,
                        "{...} holds " + quoted_for_message(word) + "; it takes one of " + sweepable_keys());
        }
        filled += match->show(draft);
        pattern.remove_prefix(end + 1);
    }
}

}  // namespace batchenc
