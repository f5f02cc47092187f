#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "io/job/job_yaml.h"
#include "io/job_file.h"

namespace batchenc {

/// A job while it is being read: the job, and its paths as the file has them (not resolved).
struct JobDraft {
    Job job;
    std::string input_text;
    std::string output_text;
};

enum class JobKeyType {
    kMapping,  ///< holds further keys
    kInteger,  ///< decimal digits, without leading zero
    kNumber,   ///< a decimal number, perhaps with a fraction and an exponent
    kBoolean,  ///< true or false
    kText,     ///< a name; quotes only where YAML readers could take it for a number, boolean or null
    kPath,     ///< a path, relative to the job file's folder
    kDataset,  ///< a path inside an HDF5 file, from its root
    kChoice,   ///< one of a few words
    kFrames,   ///< [begin, end], half-open; end may be the word end
    kSweep,    ///< mapping of dotted keys to lists
};

/// A value after its syntax and range were checked; which fields count depends on the key's type.
struct JobValue {
    std::int64_t integer = 0;         ///< kInteger, kBoolean (0 or 1), kFrames (begin)
    double number = 0.0;              ///< kNumber
    std::optional<std::int64_t> end;  ///< kFrames
    std::string text;                 ///< kText, kPath, kDataset, kChoice, a kInteger's word
};

/// One key of a job file. The one table of these drives reading, suggestions, the spelled-out job and the
/// help; docs/JOB_FILE.md is tested against it.
struct JobKey {
    std::string_view path;  ///< dotted, such as "codec.components"
    JobKeyType type;
    std::string_view sentence;  ///< what it means, with its unit
    std::int64_t low = 0;       ///< kInteger, kNumber: smallest value
    std::int64_t high = 0;      ///< kInteger, kNumber: largest value
    std::span<const std::string_view> words =
        {};  ///< kChoice: accepted words; kInteger: words beside numbers
    bool required = false;
    bool sweepable = false;
    void (*assign)(JobDraft&, const JobValue&) = nullptr;  ///< nothing for kMapping, kSweep
    std::string (*show)(const JobDraft&) = nullptr;        ///< the value as YAML; same
};

/// All keys, every mapping before what it holds.
std::span<const JobKey> job_keys();

/// The key with this dotted path, or nullptr.
const JobKey* find_job_key(std::string_view path);

/// Words for a key that does not exist inside the mapping `parent` (dotted path, empty for the root): a
/// nearly right key, or the mapping where this key belongs; empty when nothing is near.
std::string suggest_key(std::string_view parent, std::string_view key);

/// The word of `words` that `word` was probably meant to be; empty when none is near.
std::string_view nearest_word(std::string_view word, std::span<const std::string_view> words);

/// Checks syntax, type and range of a value for a key that has one.
/// Error: kInvalidArgument with place.
Expected<JobValue> read_value(const JobKey& key, const YamlNode& node, const std::string& file);

/// Type, range and words of a key for people: "integer, 1 to 4096", "preserve, free".
std::string describe_range(const JobKey& key);

/// The default as YAML, "required" where there is none.
std::string describe_default(const JobKey& key);

/// Text as a double-quoted YAML scalar.
std::string quoted_yaml(std::string_view text);

}  // namespace batchenc
