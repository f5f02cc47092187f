#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "io/result_file.h"

namespace batchenc::testing {

/// What a small result holds; everything different from everything else.
struct ResultContent {
    ResultHeader header{"rlpca", "name: dance\ncodec: {method: rlpca}\n", 5, 2, 7, 24.0, "dance"};
    std::vector<std::uint8_t> connectivity = std::vector<std::uint8_t>(40, 0xc0);
    std::vector<ClipSpan> spans = {{0, 4}, {4, 3}};
    std::vector<std::vector<std::uint8_t>> clips = {std::vector<std::uint8_t>(100, 0xa1),
                                                    std::vector<std::uint8_t>(60, 0xb2)};
    std::vector<std::int32_t> labels = {0, 1, 1, 0, 2};
    std::vector<float> vertex_rmse = {0.5F, 0.25F, 0.125F, 0.0F, 1.0F};
    std::vector<double> cluster_deviation = {0.25, 0.0, 1.5};
    ResultMetrics metrics{{{"bpvf", 2.5},
                           {"da", 0.125},
                           {"kg", 0.5},
                           {"bits_total", 1600.0},
                           {"rmse", 0.1},
                           {"max_error", 0.3},
                           {"encode_time_s", 1.5},
                           {"decode_time_s", 0.5},
                           {"max_error_relative", 1e-4},
                           {"bits_headers", 100.0}},
                          {1, 2, 3, 4, 5, 6, 7},
                          {2, 4, 6, 8, 10, 12, 14},
                          {0, 3, 6, 9, 12, 15, 18}};
};

inline Expected<void> write_result(const std::filesystem::path& path, const ResultContent& content,
                                   bool overwrite, bool analysis = true) {
    auto writer = ResultWriter::create(path, content.header, overwrite);
    if (!writer) return tl::unexpected(writer.error());
    if (content.header.triangle_count > 0)
        if (auto written = (*writer)->write_connectivity(content.connectivity); !written) return written;
    for (std::size_t i = 0; i < content.clips.size(); ++i) {
        if (auto written = (*writer)->write_clip(content.spans[i], content.clips[i]); !written)
            return written;
        if (!analysis) continue;
        if (auto written =
                (*writer)->write_analysis({content.labels, content.vertex_rmse, content.cluster_deviation});
            !written)
            return written;
    }
    return (*writer)->finish(content.metrics);
}

/// "" where a result opens, reads, and holds exactly `content`; else what differs or fails.
inline std::string difference(const std::filesystem::path& path, const ResultContent& content) {
    auto reader = ResultReader::open(path);
    if (!reader) return "error: " + reader.error().to_string();
    const ResultHeader& header = (*reader)->header();
    const ResultHeader& expected = content.header;
    if (header.method != expected.method || header.job != expected.job || header.name != expected.name)
        return "texts differ";
    if (header.vertex_count != expected.vertex_count || header.triangle_count != expected.triangle_count ||
        header.frame_count != expected.frame_count || header.fps != expected.fps)
        return "counts differ";
    const ResultMetrics& metrics = (*reader)->metrics();
    if (metrics.values != content.metrics.values || metrics.frame_rmse != content.metrics.frame_rmse ||
        metrics.frame_max_error != content.metrics.frame_max_error ||
        metrics.frame_jump != content.metrics.frame_jump)
        return "metrics differ";
    const auto connectivity = (*reader)->read_connectivity();
    if (!connectivity) return "error: " + connectivity.error().to_string();
    if (*connectivity != (expected.triangle_count > 0 ? content.connectivity : std::vector<std::uint8_t>{}))
        return "connectivity differs";
    if ((*reader)->clips().size() != content.clips.size()) return "clip count differs";
    for (std::size_t i = 0; i < content.clips.size(); ++i) {
        const ClipSpan& span = (*reader)->clips()[i];
        if (span.first_frame != content.spans[i].first_frame ||
            span.frame_count != content.spans[i].frame_count)
            return "span differs";
        const auto clip = (*reader)->read_clip(static_cast<std::int64_t>(i));
        if (!clip) return "error: " + clip.error().to_string();
        if (*clip != content.clips[i]) return "clip differs";
    }
    return "";
}

}  // namespace batchenc::testing
