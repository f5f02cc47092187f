#include "pipeline/segment_source.h"

#include <cmath>

#include "io/labels_file.h"
#include "io/mesh/mesh_file.h"
#include "io/source_clip.h"
#include "pipeline/frame_range.h"
#include "pipeline/guarded.h"
#include "pipeline/stopwatch.h"

namespace batchenc {

namespace {

/// Hues a golden angle apart, so that any few clusters in a row differ, in three brightnesses.
Color color_of(std::int32_t label) {
    const double turn = 6.0 * std::fmod(0.618033988749895 * static_cast<double>(label), 1.0);
    constexpr double kBrightness[] = {1.0, 0.72, 0.5};
    Color color;
    for (std::size_t c = 0; c < 3; ++c) {
        const double phase = std::fmod(turn + 2.0 * static_cast<double>(c), 6.0);
        const double wave = phase < 3.0 ? phase - 1.0 : 5.0 - phase;  // 0 to 1 and back over half a turn
        const double channel = 0.15 + 0.85 * std::min(1.0, std::max(0.0, wave));
        color[c] = static_cast<std::uint8_t>(255.0 * kBrightness[label % 3] * channel);
    }
    return color;
}

Expected<void> check_outputs(const SegmentRequest& request) {
    std::error_code ignored;  // a path that cannot be looked up is no other's twin
    for (const auto& output : {request.output, request.ply}) {
        if (output.empty()) continue;
        if (std::filesystem::equivalent(request.source, output, ignored))
            return fail(ErrorCode::kInvalidArgument, "the output is the source itself", output.string());
        // Before the work, which a file in the way would waste; the writer looks again.
        if (!request.overwrite && std::filesystem::exists(output, ignored))
            return fail(ErrorCode::kExists, "exists; --overwrite replaces it", output.string());
    }
    if (!request.ply.empty() && request.ply.extension() != ".ply")
        return fail(ErrorCode::kInvalidArgument, "a picture by clusters is written as .ply",
                    request.ply.string());
    if (request.ply.lexically_normal() == request.output.lexically_normal())
        return fail(ErrorCode::kInvalidArgument, "labels and picture want the same file",
                    request.output.string());
    return {};
}

Expected<SegmentReport> segment(const SegmentRequest& request, const Executor& executor) {
    if (auto checked = check_outputs(request); !checked) return tl::unexpected(checked.error());
    auto source = SourceClip::open(request.source);
    if (!source) return tl::unexpected(source.error());
    SourceClip& clip = **source;
    const auto span =
        frames_of("clip", request.source, clip.frame_count(), request.frame_begin, request.frame_end);
    if (!span) return tl::unexpected(span.error());
    const std::int64_t begin = span->first_frame, end = begin + span->frame_count;
    // The frames, the same again in blocks, and a column of theta for every cluster.
    const std::int64_t clusters =
        request.parameters.clusters > 0 ? request.parameters.clusters : std::int64_t{kMostAutomaticClusters};
    const std::int64_t needed_bytes =
        clip.vertex_count() * (24 * (end - begin) + 4 * std::min(clusters, clip.vertex_count()));
    if (needed_bytes > request.memory_bytes)
        return fail(ErrorCode::kLimit,
                    "these frames need " + std::to_string(needed_bytes >> 20) +
                        " MiB; allow more with --memory, or segment fewer with --frames",
                    request.source.string());
    auto triangles = clip.read_triangles();
    if (!triangles) return tl::unexpected(triangles.error());
    const std::int64_t vertex_count = clip.vertex_count();
    std::vector<float> positions(static_cast<std::size_t>(3 * vertex_count * (end - begin)));
    if (auto read = clip.read_frames(begin, {positions.data(), end - begin, vertex_count}, executor); !read)
        return tl::unexpected(read.error());
    const PositionsView view(positions.data(), end - begin, vertex_count);

    const Stopwatch watch;
    auto segmentation = segment_clip(view, *triangles, request.parameters, executor);
    if (!segmentation) return tl::unexpected(segmentation.error());
    SegmentReport report{std::move(*segmentation), end - begin, vertex_count, watch.seconds()};

    const Segmentation& found = report.segmentation;
    if (!request.ply.empty()) {
        std::vector<Color> colors;
        for (const std::int32_t label : found.labels) colors.push_back(color_of(label));
        if (auto done = write_mesh(request.ply, view.frames(0, 1), *triangles, colors, request.overwrite);
            !done)
            return tl::unexpected(done.error());
    }
    LabelsContent content;
    content.source = request.source.filename().string();
    content.method = to_name(request.parameters.method);
    content.first_frame = begin;
    content.frame_count = end - begin;
    content.average_deviation = found.average_deviation();
    content.labels = found.labels;
    content.vertex_deviation = found.deviations;
    content.seed_triangles = found.seed_triangles;
    content.cluster_deviation = found.cluster_deviations;
    if (auto done = write_labels(request.output, content, request.overwrite); !done)
        return tl::unexpected(done.error());
    return report;
}

}  // namespace

Expected<SegmentReport> segment_source(const SegmentRequest& request, const Executor& executor,
                                       const std::atomic<bool>& stop) {
    return guarded(stop, [&] { return segment(request, executor); });
}

}  // namespace batchenc
