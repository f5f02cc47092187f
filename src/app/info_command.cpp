#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "app/commands.h"
#include "app/exit_code.h"
#include "app/log.h"
#include "codecs/clip_codec.h"
#include "io/result_file.h"

namespace batchenc {

namespace {

struct CodedClip {
    ClipSpan span;
    ClipInfo info;
};

Expected<std::vector<CodedClip>> read_clips(ResultReader& reader, const std::string& path) {
    std::vector<CodedClip> clips;
    for (const ClipSpan& span : reader.clips()) {
        const auto index = static_cast<std::int64_t>(clips.size());
        const auto bitstream = reader.read_clip(index);
        if (!bitstream) return tl::unexpected(bitstream.error());
        const auto info = read_clip_info(*bitstream);
        if (!info) return fail_within(path + ": clip " + std::to_string(index), info.error());
        clips.push_back({span, *info});
    }
    return clips;
}

nlohmann::json to_json(const SectionBytes& bytes) {
    return {{"headers", bytes.headers}, {"segmentation", bytes.segmentation}, {"frames", bytes.frames},
            {"basis", bytes.basis},     {"coefficients", bytes.coefficients}, {"residuals", bytes.residuals}};
}

/// What a stream says of its coder's parameters: of each coder those that it has.
nlohmann::json to_json(const CodecParameters& parameters) {
    nlohmann::json json = {{"method", to_name(parameters.method)}};
    switch (parameters.method) {
        case CodecMethod::kStatic:
            json["bits"] = parameters.bits;
            return json;
        case CodecMethod::kSplitcoder:
            json.update({{"predictor", to_name(parameters.predictor)},
                         {"normal", to_name(parameters.normal)},
                         {"max_error", parameters.max_error}});
            return json;
        case CodecMethod::kPdct:
            json.update({{"bits", parameters.bits},
                         {"intra_bits", parameters.intra_bits},
                         {"frame_bits", parameters.frame_bits},
                         {"transform", to_name(parameters.transform)}});
            if (parameters.transform == PdctTransform::kTemporal) json["block"] = parameters.block;
            return json;
        case CodecMethod::kRtpca:
            json.update({{"step", parameters.step}, {"max_error", parameters.max_error}});
            return json;
        case CodecMethod::kRlpca:
        case CodecMethod::kOrlpca:
            json.update({{"space", to_name(parameters.space)},
                         {"components", parameters.components},
                         {"basis_bits", parameters.basis_bits},
                         {"coefficient_bits", parameters.coefficient_bits},
                         {"frame_bits", parameters.frame_bits}});
            return json;
        default:  // baselines
            json.update({{"bits", parameters.bits},
                         {"components", parameters.components},
                         {"basis_bits", parameters.basis_bits},
                         {"coefficient_bits", parameters.coefficient_bits},
                         {"lpc_order", parameters.lpc_order},
                         {"predictor", to_name(parameters.predictor)}});
            return json;
    }
}

nlohmann::json to_json(const CodedClip& clip) {
    return {{"first_frame", clip.span.first_frame},
            {"frame_count", clip.span.frame_count},
            {"clusters", clip.info.cluster_count},
            {"components", clip.info.component_count},
            {"parameters", to_json(clip.info.parameters)},
            {"bytes", clip.info.section_bytes.total()},
            {"section_bytes", to_json(clip.info.section_bytes)}};
}

nlohmann::json to_json(const ResultReader& reader, std::size_t connectivity_bytes,
                       const std::vector<CodedClip>& clips) {
    const ResultHeader& header = reader.header();
    nlohmann::json json = {{"format", "batchenc"},
                           {"method", header.method},
                           {"name", header.name},
                           {"job", header.job},
                           {"vertex_count", header.vertex_count},
                           {"triangle_count", header.triangle_count},
                           {"frame_count", header.frame_count},
                           {"fps", header.fps},
                           {"connectivity_bytes", connectivity_bytes},
                           {"clips", nlohmann::json::array()},
                           {"metrics", reader.metrics().values}};  // NaN, which is undefined, becomes null
    const std::vector<double>& jumps = reader.metrics().frame_jump;
    for (const CodedClip& clip : clips) {
        json["clips"].push_back(to_json(clip));
        if (!jumps.empty())
            json["clips"].back()["seam_jump"] = jumps[static_cast<std::size_t>(clip.span.first_frame)];
    }
    return json;
}

void print_text(const ResultReader& reader, std::size_t connectivity_bytes,
                const std::vector<CodedClip>& clips) {
    const ResultHeader& header = reader.header();
    // Texts from the file are printed as JSON strings: a terminal must not obey them.
    fmt::print("name        {}\nmethod      {}\n", to_line(header.name), to_line(header.method));
    fmt::print("shape       {} vertices, {} triangles, {} frames, {:g} fps\n\n", header.vertex_count,
               header.triangle_count, header.frame_count, header.fps);
    fmt::print("connectivity {} bytes\n", connectivity_bytes);
    fmt::print("{:>6} {:>9} {:>7} {:>5} {:>5} {:>11} {:>8} {:>10} {:>10} {:>10} {:>12} {:>9} {:>10}\n",
               "clip", "from", "frames", "N", "L", "bytes", "headers", "segment.", "frames", "basis",
               "coefficients", "residuals", "seam jump");
    const std::vector<double>& jumps = reader.metrics().frame_jump;
    for (std::size_t i = 0; i < clips.size(); ++i) {
        const SectionBytes& bytes = clips[i].info.section_bytes;
        fmt::print("{:>6} {:>9} {:>7} {:>5} {:>5} {:>11} {:>8} {:>10} {:>10} {:>10} {:>12} {:>9} {:>10}\n", i,
                   clips[i].span.first_frame, clips[i].span.frame_count, clips[i].info.cluster_count,
                   clips[i].info.component_count, bytes.total(), bytes.headers, bytes.segmentation,
                   bytes.frames, bytes.basis, bytes.coefficients, bytes.residuals,
                   jumps.empty()
                       ? "-"
                       : fmt::format("{:.3g}", jumps[static_cast<std::size_t>(clips[i].span.first_frame)]));
    }
    fmt::print("\n");
    for (const auto& [name, value] : reader.metrics().values) fmt::print("{:<20} {:.10g}\n", name, value);
}

Expected<void> print_info(const InfoOptions& options) {
    const std::string path = options.result.string();
    auto reader = ResultReader::open(options.result);
    if (!reader) return tl::unexpected(reader.error());
    const auto connectivity = (*reader)->read_connectivity();
    if (!connectivity) return tl::unexpected(connectivity.error());
    const auto clips = read_clips(**reader, path);
    if (!clips) return tl::unexpected(clips.error());
    if (options.json)
        fmt::print("{}\n", to_line(to_json(**reader, connectivity->size(), *clips)));
    else
        print_text(**reader, connectivity->size(), *clips);
    return {};
}

}  // namespace

int run_command(const InfoOptions& options, const CommonOptions&, const std::atomic<bool>&) {
    const auto done = print_info(options);
    if (done) return kExitDone;
    log_error(done.error());
    return kExitFailed;
}

}  // namespace batchenc
