#include "app/command_line.h"

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <charconv>
#include <iostream>
#include <map>

#include "app/exit_code.h"
#include "io/job_file.h"
#include "pipeline/threads.h"

namespace batchenc {

namespace {

constexpr const char* kDescription =
    "batchenc compresses 3D mesh animation in batches.\n"
    "A job file names a source clip (HDF5), the coder and its parameters, and the result (HDF5).";

constexpr const char* kExamples =
    "Examples:\n"
    "  batchenc synth walker -o walker.h5          make a sample clip\n"
    "  batchenc jobs/*.yaml                        encode every job; clips of several jobs run together\n"
    "  batchenc --dry-run jobs/*.yaml              say what would be done, and check that the inputs open\n"
    "  batchenc --resume jobs/*.yaml               go on after an interruption, keeping what is whole\n"
    "  batchenc info out/walker.h5                 where the bits went, and how good it is\n"
    "  batchenc decode out/walker.h5 -o back.h5    the clip again\n"
    "  batchenc verify out/walker.h5 --source walker.h5\n"
    "  batchenc segment walker.h5 -o labels.h5 --ply labels.ply\n"
    "\n"
    "Exit codes: 0 all done; 1 some job failed, the others are done; 2 mistake in the command line or in a\n"
    "job file, nothing was run; 130 interrupted, nothing half-written is left.\n"
    "stdout carries results, stderr the log and the progress. `batchenc --help-job` explains job files.";

/// Bytes that this process should not exceed by itself: half of what the machine has.
std::int64_t default_memory_bytes() { return sysconf(_SC_PHYS_PAGES) / 2 * sysconf(_SC_PAGESIZE); }

/// "BEGIN:END", either side may be missing; false for anything else.
bool parse_frame_range(const std::string& text, FrameRange& range) {
    const auto colon = text.find(':');
    if (colon == std::string::npos) return false;
    const auto parse = [](const char* begin, const char* end, std::int64_t& value) {
        const auto [rest, error] = std::from_chars(begin, end, value);
        return error == std::errc() && rest == end && value >= 0;
    };
    const char* const data = text.data();
    if (colon > 0 && !parse(data, data + colon, range.begin)) return false;
    if (colon + 1 == text.size()) return true;
    return parse(data + colon + 1, data + text.size(), range.end.emplace()) && range.begin < *range.end;
}

constexpr const char* kCommonGroup = "Common options";

void add_log_options(CLI::App& app, CommonOptions& options) {
    app.add_flag("--log-json", options.log_json, "Log one JSON object a line")->group(kCommonGroup);
    app.add_option("--log-level", options.log_level, "debug, info, warning, error or off (default: info)")
        ->check(CLI::IsMember({"debug", "info", "warning", "error", "off"}))
        ->group(kCommonGroup);
}

void add_progress_option(CLI::App& app, CommonOptions& options) {
    app.add_option("--progress", options.progress,
                   "auto, bar, plain (a line `PROGRESS: 42%` a step) or none; auto is bar on a terminal, "
                   "plain elsewhere")
        ->check(CLI::IsMember({"auto", "bar", "plain", "none"}))
        ->group(kCommonGroup);
}

void add_work_options(CLI::App& app, CommonOptions& options) {
    app.add_option("--threads", options.threads, "Threads to work with (default: every processor)")
        ->check(CLI::Range(1, 1024))
        ->group(kCommonGroup);
    add_progress_option(app, options);
    add_log_options(app, options);
}

void add_memory_option(CLI::App& app, CommonOptions& options) {
    app.add_option("--memory", options.memory_bytes,
                   "Memory to keep to, such as 800M or 4G (default: half of the machine's)")
        ->transform(CLI::AsSizeValue(false).description("at least 1M"))
        ->check(CLI::Range(std::int64_t{1} << 20, std::int64_t{1} << 50).description(""))
        ->group(kCommonGroup);
}

void add_frames_option(CLI::App& app, FrameRange& range) {
    app.add_option_function<std::string>(
           "--frames",
           [&range](const std::string& text) {
               if (!parse_frame_range(text, range))
                   throw CLI::ValidationError("--frames", "wants BEGIN:END with BEGIN < END, not " + text);
           },
           "Only frames BEGIN to END-1, counted from 0")
        ->type_name("BEGIN:END");
}

/// The command line as CLI11 fills it in, before one command is chosen.
struct Parser {
    CLI::App app{kDescription, "batchenc"};
    CommonOptions common;
    EncodeOptions encode;
    DecodeOptions decode;
    InfoOptions info;
    VerifyOptions verify;
    SegmentOptions segment;
    ImportOptions import;
    ExportOptions exporting;
    SynthOptions synth;
    Command chosen;
    std::vector<CLI::Option*> encode_options;

    Parser() {
        common.threads = default_thread_count();
        common.memory_bytes = default_memory_bytes();
        app.footer(kExamples);
        app.set_version_flag("--version", std::string("batchenc ") + BATCHENC_VERSION);
        app.add_flag_callback(
            "--help-job",
            [] {
                std::cout << job_help();
                throw CLI::Success();
            },
            "Print every key of a job file: type, default, range, meaning");
        add_work_options(app, common);
        add_memory_option(app, common);
        add_encode();
        add_decode();
        add_info();
        add_verify();
        add_segment();
        add_import();
        add_export();
        add_synth();
        app.require_subcommand(0, 1);
    }

    CLI::App* add_command(const char* name, const char* description) {
        CLI::App* command = app.add_subcommand(name, description);
        for (CLI::Option* option : encode_options) command->excludes(option);
        return command;
    }

    void add_encode() {
        auto* jobs = app.add_option("JOB.yaml", encode.job_files, "Job files to encode");
        auto* overwrite = app.add_flag_callback(
            "--overwrite", [this] { encode.existing = ExistingOutput::kReplace; },
            "Replace results that exist");
        auto* resume = app.add_flag_callback(
            "--resume", [this] { encode.existing = ExistingOutput::kResume; },
            "Keep results that exist, are whole and were made by the same job; make the others again");
        auto* dry_run = app.add_flag("--dry-run", encode.dry_run,
                                     "Print what would be done and check that the inputs open");
        resume->excludes(overwrite);
        encode_options = {jobs, overwrite, resume, dry_run};
    }

    void add_decode() {
        auto* command = add_command("decode", "Decode a result into a clip file");
        command->add_option("RESULT", decode.result, "Result file")->required();
        command->add_option("-o,--output", decode.output, "Clip to be written (HDF5)")->required();
        add_frames_option(*command, decode.frames);
        command
            ->add_option(
                "--components", decode.components,
                "Use only the first so many principal components: of each cluster, with rtpca of all "
                "clusters together")
            ->check(CLI::Range(1, 4096));
        command->add_flag("--overwrite", decode.overwrite, "Replace a clip that exists");
        command->footer(
            "Example:\n  batchenc decode out/dance.h5 -o preview.h5 --frames 0:50 --components 5");
        add_work_options(*command, common);
        add_memory_option(*command, common);
        command->callback([this] { chosen = decode; });
    }

    void add_info() {
        auto* command =
            add_command("info", "Print sizes by section, method, parameters and metrics of a result");
        command->add_option("RESULT", info.result, "Result file")->required();
        command->add_flag("--json", info.json, "Print one JSON object");
        command->footer("Example:\n  batchenc info out/dance.h5 --json | jq .metrics.bpvf");
        add_log_options(*command, common);
        command->callback([this] { chosen = info; });
    }

    void add_verify() {
        auto* command =
            add_command("verify", "Decode a result, measure it against its source, compare with its metrics");
        command->add_option("RESULT", verify.result, "Result file")->required();
        command->add_option("--source", verify.source, "Clip that the result was made from")->required();
        command->footer("Example:\n  batchenc verify out/dance.h5 --source data/dance.h5");
        add_work_options(*command, common);
        add_memory_option(*command, common);
        command->callback([this] { chosen = verify; });
    }

    void add_segment() {
        auto* command =
            add_command("segment", "Group the vertices of a clip into clusters that move together, alone");
        command->add_option("SOURCE", segment.source, "Clip to segment (HDF5)")->required();
        command->add_option("-o,--output", segment.output, "File of labels to be written (HDF5)")->required();
        command->add_option("--ply", segment.ply, "Also write the first frame as PLY, coloured by cluster");
        std::map<std::string, SegmentationMethod> methods;
        for (const SegmentationMethod method :
             {SegmentationMethod::kRegionGrowing, SegmentationMethod::kClustering,
              SegmentationMethod::kAdaptive, SegmentationMethod::kRigid})
            methods.emplace(to_name(method), method);
        command
            ->add_option_function<std::string>(
                "--method",
                [this, methods](const std::string& name) { segment.parameters.method = methods.at(name); },
                "How clusters are found (default: clustering)")
            ->check(CLI::IsMember(methods));
        command
            ->add_option("--clusters", segment.parameters.clusters,
                         "Clusters wanted, or 0 for as many as pay (default: 20)")
            ->check(CLI::Range(0, 65535));
        command
            ->add_option("--threshold", segment.parameters.threshold,
                         "No more clusters than bring the average step to this part of e_max (default: 0, no "
                         "such bound)")
            ->check(CLI::Range(0.0, 1.0));
        add_frames_option(*command, segment.frames);
        command->add_flag("--overwrite", segment.overwrite, "Replace files that exist");
        command->footer(
            "Example:\n  batchenc segment dance.h5 -o labels.h5 --method adaptive --clusters 14 --ply "
            "dance.ply");
        add_work_options(*command, common);
        add_memory_option(*command, common);
        command->callback([this] { chosen = segment; });
    }

    void add_import() {
        auto* command = add_command(
            "import", "Make a clip of meshes (.obj, .off, .ply), a frame each; vertices keep their order");
        command->add_option("FILE", import.meshes, "Meshes, a frame each, in this order")->required();
        command->add_option("-o,--output", import.output, "Clip to be written (HDF5)")->required();
        command->add_option("--fps", import.fps, "Frames per second (default: 0, unknown)")
            ->check(CLI::Range(0.0, 1e6));
        command->add_option("--name", import.name, "Name of the clip (default: the file's)");
        command->add_flag("--overwrite", import.overwrite, "Replace a clip that exists");
        command->footer("Example:\n  batchenc import frames/*.obj -o clip.h5 --fps 25");
        add_progress_option(*command, common);
        add_log_options(*command, common);
        command->callback([this] { chosen = import; });
    }

    void add_export() {
        auto* command = add_command("export", "Write frames of a clip as meshes (.obj, .off, .ply)");
        command->add_option("CLIP", exporting.clip, "Clip (HDF5)")->required();
        command
            ->add_option("-o,--output", exporting.output,
                         "Mesh to be written; of several frames its name has {frame}, for the frame's number")
            ->required();
        add_frames_option(*command, exporting.frames);
        command->add_flag("--ascii", exporting.ascii, "Write .ply as text, as .obj and .off always are");
        command->add_flag("--overwrite", exporting.overwrite, "Replace files that exist");
        command->footer(
            "Examples:\n  batchenc export clip.h5 -o frame_{frame}.obj\n"
            "  batchenc export clip.h5 -o first.ply --frames 0:1");
        add_progress_option(*command, common);
        add_log_options(*command, common);
        command->callback([this] { chosen = exporting; });
    }

    void add_synth() {
        auto* command = add_command("synth", "Make a sample clip, the same for the same arguments");
        command
            ->add_option("KIND", synth.kind,
                         "walker (articulated, near-rigid parts), flag (cloth with a boundary), jelly "
                         "(elastic body) or medley (all three in turn)")
            ->required();
        command->add_option("-o,--output", synth.output, "Clip to be written (HDF5)")->required();
        command->add_option("--vertices", synth.vertices, "Vertices, within 5 % (default: 5000)");
        command->add_option("--frames", synth.frames, "Frames (default: 120)")->check(CLI::Range(1, 1 << 24));
        command->add_option("--seed", synth.seed, "Another seed makes another clip (default: 1)");
        command->add_flag("--overwrite", synth.overwrite, "Replace a clip that exists");
        command->footer(
            "Example:\n  batchenc synth jelly -o jelly.h5 --vertices 20000 --frames 240 --seed 7");
        add_work_options(*command, common);
        command->callback([this] { chosen = synth; });
    }
};

}  // namespace

std::variant<CommandLine, int> parse_command_line(int argc, const char* const* argv) {
    Parser parser;
    try {
        parser.app.parse(argc, argv);
        if (parser.app.get_subcommands().empty()) {
            if (parser.encode.job_files.empty())
                throw CLI::RequiredError("a job file or a command (see batchenc --help)");
            parser.chosen = parser.encode;
        }
    } catch (const CLI::ParseError& error) {
        return parser.app.exit(error) == 0 ? kExitDone : kExitUsage;
    }
    return CommandLine{parser.common, parser.chosen};
}

}  // namespace batchenc
