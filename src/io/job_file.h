#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/parameters.h"

namespace batchenc {

/// As a clip length: the sequence is cut where its motion changes.
inline constexpr std::int64_t kAutomaticClips = -1;

/// One encoding to be done: a job file, or one member of its sweep. All paths are resolved against the job
/// file's folder.
struct Job {
    std::string name;
    std::filesystem::path file;   ///< the job file
    std::filesystem::path input;  ///< source clip
    std::string positions = "/positions";
    std::string triangles = "/triangles";
    std::int64_t frame_begin = 0;
    std::optional<std::int64_t> frame_end;  ///< one past the last frame; nothing means to the end
    std::filesystem::path output;
    std::int64_t clip_length = 0;  ///< frames a clip; 0 = the whole sequence, kAutomaticClips = as it pays
    MeshOrder order = MeshOrder::kPreserve;
    SegmentationParameters segmentation;
    CodecParameters codec;
    bool analysis = true;
    /// This job alone as YAML: sweep resolved, every parameter spelled out, paths as the file has them. Goes
    /// into the result; parse_job of it with the same path gives this job again.
    std::string yaml;
};

/// Reads a job file and multiplies its sweep out; at least one job. docs/JOB_FILE.md is the reference.
///
/// Strict: unknown and duplicate keys, wrong types, numbers that YAML readers disagree about (010), values
/// outside their range, anchors and aliases, and a second document are errors with file, line and column; a
/// key that is nearly right is named. No two jobs of a sweep write the same output. Errors: kIo (cannot
/// read), kFormat (not YAML), kInvalidArgument, kUnsupported (of a later version), kLimit (file over 1 MiB,
/// nested too deep, sweep over 10,000 jobs), kOutOfMemory; `where` is "file:line:column", of kIo and
/// kOutOfMemory the file.
Expected<std::vector<Job>> read_job_file(const std::filesystem::path& path);

/// The same for text that is already in memory; `path` stands in errors and resolves relative paths.
Expected<std::vector<Job>> parse_job(const std::string& text, const std::filesystem::path& path);

/// A table of every key: type, default, unit or range, and a sentence; what --help-job prints.
std::string job_help();

}  // namespace batchenc
