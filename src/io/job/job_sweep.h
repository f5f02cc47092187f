#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "io/job/job_schema.h"

namespace batchenc {

/// Most jobs that one sweep may make.
inline constexpr std::int64_t kMaxSweepJobs = 10000;

/// One key of a sweep with its values, checked.
struct SweepAxis {
    const JobKey* key = nullptr;
    std::vector<JobValue> values;
    std::vector<TextPosition> places;  ///< of each value
};

/// Reads the mapping under `sweep`. Errors: kInvalidArgument (no such key, a key that is not swept, no list,
/// a value twice or out of range), kUnsupported, kLimit (more than kMaxSweepJobs combinations).
Expected<std::vector<SweepAxis>> read_sweep(const YamlNode& node, const std::string& file);

/// Number of combinations; 1 without axes.
std::int64_t sweep_size(const std::vector<SweepAxis>& axes);

/// Index into each axis' values for combination `number` of sweep_size(); the last axis varies fastest.
std::vector<std::size_t> sweep_choice(const std::vector<SweepAxis>& axes, std::int64_t number);

/// Replaces {components}, {codec.components} and the like by the draft's values. Of keys that share a short
/// name the one of fewest levels is meant; where that is two the name is refused, as is any other brace.
/// Error: kInvalidArgument without place.
Expected<std::string> fill_placeholders(std::string_view pattern, const JobDraft& draft);

}  // namespace batchenc
