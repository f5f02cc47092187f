#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "core/parameters.h"
#include "pipeline/plan.h"

namespace batchenc {

/// What every command understands.
struct CommonOptions {
    int threads = 1;
    std::int64_t memory_bytes = 0;
    std::string progress = "auto";
    std::string log_level = "info";
    bool log_json = false;
};

struct EncodeOptions {
    std::vector<std::filesystem::path> job_files;
    ExistingOutput existing = ExistingOutput::kRefuse;
    bool dry_run = false;
};

/// Half-open; without an end, all that follow.
struct FrameRange {
    std::int64_t begin = 0;
    std::optional<std::int64_t> end;
};

struct DecodeOptions {
    std::filesystem::path result;
    std::filesystem::path output;
    FrameRange frames;
    std::int32_t components = -1;
    bool overwrite = false;
};

struct InfoOptions {
    std::filesystem::path result;
    bool json = false;
};

struct VerifyOptions {
    std::filesystem::path result;
    std::filesystem::path source;
};

struct SegmentOptions {
    std::filesystem::path source;
    std::filesystem::path output;
    std::filesystem::path ply;
    FrameRange frames;
    SegmentationParameters parameters;
    bool overwrite = false;
};

struct ImportOptions {
    std::vector<std::filesystem::path> meshes;
    std::filesystem::path output;
    double fps = 0.0;
    std::string name;
    bool overwrite = false;
};

struct ExportOptions {
    std::filesystem::path clip;
    std::filesystem::path output;
    FrameRange frames;
    bool ascii = false;
    bool overwrite = false;
};

struct SynthOptions {
    std::string kind;
    std::filesystem::path output;
    std::int64_t vertices = 5000;
    std::int64_t frames = 120;
    std::uint64_t seed = 1;
    bool overwrite = false;
};

using Command = std::variant<EncodeOptions, DecodeOptions, InfoOptions, VerifyOptions, SegmentOptions,
                             ImportOptions, ExportOptions, SynthOptions>;

struct CommandLine {
    CommonOptions common;
    Command command;
};

/// Reads the command line. Gives the exit code instead when there is nothing left to do: 0 after a help text
/// on stdout, 2 after a message about a mistake on stderr.
std::variant<CommandLine, int> parse_command_line(int argc, const char* const* argv);

}  // namespace batchenc
