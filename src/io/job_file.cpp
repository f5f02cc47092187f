#include "io/job_file.h"

#include <algorithm>
#include <fstream>
#include <new>
#include <system_error>
#include <unordered_map>

#include "io/job/job_schema.h"
#include "io/job/job_sweep.h"
#include "io/job/job_yaml.h"

namespace batchenc {
namespace {

/// Where in the file a draft's values stand, for errors that show only when all of it is read.
struct Places {
    std::unordered_map<std::string_view, TextPosition> by_key;

    TextPosition of(std::string_view key) const {
        const auto found = by_key.find(key);
        return found == by_key.end() ? TextPosition{} : found->second;
    }
};

Expected<void> check_codec_and_segmentation(const Job& job) {
    return check_parameters(job.segmentation).and_then([&] { return check_parameters(job.codec); });
}

/// Assigns one value. That core/parameters accepts it is checked beside defaults alone, so that a refusal is
/// about this value and has its place.
Expected<void> assign_value(const JobKey& key, const JobValue& value, TextPosition at,
                            const std::string& file, JobDraft& draft) {
    JobDraft probe;
    key.assign(probe, value);
    const auto checked =
        check_parameters(probe.job.segmentation).and_then([&] { return check_values(probe.job.codec); });
    if (!checked) {
        return fail_within(place_in(file, at), checked.error());
    }
    key.assign(draft, value);
    return {};
}

/// Reads one job file from its tree.
class JobReader {
 public:
    JobReader(const std::filesystem::path& path, std::string file) : path_(path), file_(std::move(file)) {}

    Expected<std::vector<Job>> read(const YamlNode& root) {
        return check_version(root)
            .and_then([&] { return read_mapping("", root); })
            .and_then([&] { return check_default_name(); })
            .and_then([&] { return multiply(); });
    }

 private:
    tl::unexpected<Error> refuse(TextPosition at, std::string message) const {
        return fail(ErrorCode::kInvalidArgument, std::move(message), place_in(file_, at));
    }

    /// Before anything else, so that a file of a later version is called that and not full of unknown keys.
    Expected<void> check_version(const YamlNode& root) const {
        if (root.kind != YamlNode::Kind::kMapping) {
            return refuse(root.at, "a job file is a mapping of keys; it begins with 'batchenc: 1'");
        }
        for (const YamlEntry& entry : root.entries) {
            if (entry.key != "batchenc") continue;
            JobKey any_version = *find_job_key("batchenc");
            any_version.high = 1000000;
            const auto version = read_value(any_version, entry.value, file_);
            if (!version) return tl::unexpected(version.error());
            if (version->integer == 1) return {};
            return fail(
                ErrorCode::kUnsupported,
                "job schema version " + std::to_string(version->integer) + "; this program reads version 1",
                place_in(file_, entry.value.at));
        }
        return refuse(root.at, "'batchenc: 1', the version of the job schema, is missing");
    }

    Expected<void> read_mapping(std::string_view parent, const YamlNode& node) {
        if (node.kind != YamlNode::Kind::kMapping) {
            return refuse(node.at, std::string(parent) + " must be a mapping, such as " + example_of(parent));
        }
        for (const YamlEntry& entry : node.entries) {
            if (auto done = read_entry(parent, entry); !done) return done;
        }
        for (const JobKey& key : job_keys()) {
            const bool here = key.required && key.path.substr(0, key.path.rfind('.') + 1) == prefix(parent);
            if (here && !places_.by_key.contains(key.path)) {
                return refuse(node.at, "'" + std::string(key.path) + "' is missing (" +
                                           std::string(key.sentence) + ")");
            }
        }
        return {};
    }

    Expected<void> read_entry(std::string_view parent, const YamlEntry& entry) {
        // A dotted key is never a known one here: "codec.components" is two levels, except under sweep.
        const bool dotted = entry.key.find('.') != std::string::npos;
        const JobKey* key = dotted ? nullptr : find_job_key(prefix(parent) + entry.key);
        if (!key) {
            std::string message = "unknown key " + quoted_for_message(entry.key);
            if (!parent.empty()) message += " under '" + std::string(parent) + "'";
            const std::string suggestion = suggest_key(parent, entry.key);
            return refuse(entry.at, message + (suggestion.empty() ? "" : "; " + suggestion));
        }
        places_.by_key.emplace(key->path, entry.value.at);
        switch (key->type) {
            case JobKeyType::kMapping:
                return read_mapping(key->path, entry.value);
            case JobKeyType::kSweep:
                return read_sweep(entry.value, file_).map([&](std::vector<SweepAxis> axes) {
                    axes_ = std::move(axes);
                });
            default:
                return read_value(*key, entry.value, file_).and_then([&](const JobValue& value) {
                    return assign_value(*key, value, entry.value.at, file_, draft_);
                });
        }
    }

    Expected<void> check_default_name() {
        if (places_.by_key.contains("name")) return {};
        const std::string stem = path_.stem().string();
        if (stem.empty() || find_unprintable(stem, false) != stem.size() ||
            stem.find_first_of("{}\\") != std::string::npos) {
            return refuse({}, "the file's name cannot be the job's; give it a 'name'");
        }
        draft_.job.name = stem;
        return {};
    }

    Expected<std::vector<Job>> multiply() const {
        std::vector<Job> jobs;
        std::unordered_map<std::string, std::size_t> outputs;  // path without detours → index in jobs
        for (std::int64_t number = 0; number < sweep_size(axes_); ++number) {
            auto job = member(number);
            if (!job) return tl::unexpected(job.error());
            const auto [other, is_new] =
                outputs.emplace(job->output.lexically_normal().string(), jobs.size());
            if (!is_new) {
                return refuse(places_.of("output"), "jobs " + std::to_string(other->second + 1) + " and " +
                                                        std::to_string(jobs.size() + 1) +
                                                        " of the sweep would write the same output; put " +
                                                        all_placeholders() + " into it");
            }
            jobs.push_back(std::move(*job));
        }
        return jobs;
    }

    Expected<Job> member(std::int64_t number) const {
        JobDraft draft = draft_;
        const std::vector<std::size_t> choice = sweep_choice(axes_, number);
        for (std::size_t a = 0; a < axes_.size(); ++a) {
            const SweepAxis& axis = axes_[a];
            auto done = assign_value(*axis.key, axis.values[choice[a]], axis.places[choice[a]], file_, draft);
            if (!done) return tl::unexpected(done.error());
        }
        if (draft.job.codec.method == CodecMethod::kOrlpca && !is_given("codec.components"))
            draft.job.codec.components = kDefaultMostComponents;
        if (counts_clusters(draft.job.codec.method)) {
            if (!is_given("segmentation.method")) draft.job.segmentation.method = SegmentationMethod::kRigid;
            if (!is_given("segmentation.clusters")) draft.job.segmentation.clusters = 0;
        }
        if (auto checked = check_codec_and_segmentation(draft.job); !checked) {
            return fail_within(place_in(file_, places_.of("codec")), checked.error());
        }
        auto name = fill_placeholders(draft.job.name, draft);
        if (!name) return fail_within(place_in(file_, places_.of("name")), name.error());
        auto output = fill_placeholders(draft.output_text, draft);
        if (!output) return fail_within(place_in(file_, places_.of("output")), output.error());
        draft.job.name = std::move(*name);
        draft.output_text = std::move(*output);

        draft.job.file = path_;
        draft.job.input = path_.parent_path() / draft.input_text;
        draft.job.output = path_.parent_path() / draft.output_text;
        if (draft.job.input.lexically_normal() == draft.job.output.lexically_normal()) {
            return refuse(places_.of("output"), "output is the input file; name another");
        }
        draft.job.yaml = spell_out(draft);
        return std::move(draft.job);
    }

    /// The draft as a job file of its own, every key with its value.
    static std::string spell_out(const JobDraft& draft) {
        std::string yaml;
        for (const JobKey& key : job_keys()) {
            const std::size_t dot = key.path.rfind('.');
            const auto levels = std::count(key.path.begin(), key.path.end(), '.');
            const std::string indent(2 * static_cast<std::size_t>(levels), ' ');
            const std::string word(key.path.substr(dot + 1));  // npos + 1 is 0
            if (key.type == JobKeyType::kMapping) yaml += indent + word + ":\n";
            if (key.show) yaml += indent + word + ": " + key.show(draft) + "\n";
        }
        return yaml;
    }

    /// Whether the file says what a key is, once or in its sweep.
    bool is_given(std::string_view path) const {
        return places_.by_key.contains(path) ||
               std::any_of(axes_.begin(), axes_.end(),
                           [&](const SweepAxis& axis) { return axis.key->path == path; });
    }
    std::string all_placeholders() const {
        std::string list;
        for (const SweepAxis& axis : axes_)
            list += (list.empty() ? "{" : ", {") + std::string(axis.key->path) + "}";
        return list;
    }
    static std::string prefix(std::string_view parent) {
        return parent.empty() ? "" : std::string(parent) + ".";
    }
    static std::string example_of(std::string_view parent) {
        for (const JobKey& key : job_keys()) {
            if (!key.path.starts_with(prefix(parent)) || !key.show) continue;
            const std::string value = key.required ? "clip.h5" : key.show(JobDraft{});
            return "{" + std::string(key.path.substr(parent.size() + 1)) + ": " + value + "}";
        }
        return "{key: value}";
    }

    std::filesystem::path path_;
    std::string file_;
    JobDraft draft_;
    Places places_;
    std::vector<SweepAxis> axes_;
};

}  // namespace

Expected<std::vector<Job>> parse_job(const std::string& text, const std::filesystem::path& path) {
    const std::string file = path.string();
    try {
        auto root = parse_strict_yaml(text, file);
        if (!root) return tl::unexpected(root.error());
        return JobReader(path, file).read(*root);
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::kOutOfMemory, "not enough memory to read the job file", file);
    }
}

Expected<std::vector<Job>> read_job_file(const std::filesystem::path& path) {
    const std::string file = path.string();
    std::error_code error;
    const auto status = std::filesystem::status(path, error);
    if (!std::filesystem::exists(status)) {
        return fail(ErrorCode::kIo, "cannot read: " + (error ? error.message() : "no such file"), file);
    }
    if (!std::filesystem::is_regular_file(status))
        return fail(ErrorCode::kIo, "cannot read: not a file", file);
    std::string text;
    try {
        std::ifstream stream(path, std::ios::binary);
        if (!stream) return fail(ErrorCode::kIo, "cannot read: permission denied or gone", file);
        text.resize(kMaxJobFileBytes + 1);  // one more than allowed, so that parse_job sees what is too long
        stream.read(text.data(), static_cast<std::streamsize>(text.size()));
        if (stream.bad()) return fail(ErrorCode::kIo, "cannot read: input error", file);
        text.resize(static_cast<std::size_t>(stream.gcount()));
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::kOutOfMemory, "not enough memory to read the job file", file);
    }
    return parse_job(text, path);
}

}  // namespace batchenc
