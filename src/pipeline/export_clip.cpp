#include "pipeline/export_clip.h"

#include "io/mesh/mesh_file.h"
#include "io/source_clip.h"
#include "pipeline/frame_range.h"
#include "pipeline/guarded.h"

namespace batchenc {

namespace {

constexpr std::string_view kPlaceholder = "{frame}";

std::filesystem::path path_of_frame(const std::filesystem::path& pattern, std::int64_t frame,
                                    std::int64_t frame_end) {
    std::string name = pattern.filename().string();
    const std::size_t at = name.find(kPlaceholder);
    if (at == std::string::npos) return pattern;
    std::string number = std::to_string(frame);
    const std::size_t digits = std::max<std::size_t>(4, std::to_string(frame_end - 1).size());
    number.insert(0, digits - number.size(), '0');
    return pattern.parent_path() / name.replace(at, kPlaceholder.size(), number);
}

Expected<std::int64_t> write_frames(const ExportRequest& request, const std::atomic<bool>& stop,
                                    const std::function<void(double)>& progress) {
    std::error_code ignored;  // a path that cannot be looked up is no other's twin
    if (std::filesystem::equivalent(request.clip, request.output, ignored))
        return fail(ErrorCode::kInvalidArgument, "the output is the clip itself", request.output.string());
    auto source = SourceClip::open(request.clip);
    if (!source) return tl::unexpected(source.error());
    SourceClip& clip = **source;
    const auto span =
        frames_of("clip", request.clip, clip.frame_count(), request.frame_begin, request.frame_end);
    if (!span) return tl::unexpected(span.error());
    const std::int64_t begin = span->first_frame, end = begin + span->frame_count;
    if (end - begin > 1 && request.output.filename().string().find(kPlaceholder) == std::string::npos)
        return fail(
            ErrorCode::kInvalidArgument,
            std::to_string(end - begin) +
                " frames want a name with {frame}, such as frame_{frame}.obj; or choose one with --frames",
            request.output.string());
    const auto triangles = clip.read_triangles();
    if (!triangles) return tl::unexpected(triangles.error());
    std::vector<float> positions(static_cast<std::size_t>(3 * clip.vertex_count()));
    for (std::int64_t f = begin; f < end; ++f) {
        if (stop.load(std::memory_order_relaxed)) throw Interrupted{};
        const MutablePositionsView frame(positions.data(), 1, clip.vertex_count());
        if (auto read = clip.read_frames(f, frame); !read) return tl::unexpected(read.error());
        if (auto done =
                write_mesh(path_of_frame(request.output, f, end), frame, *triangles, {}, request.overwrite,
                           request.ascii ? PlyEncoding::kAscii : PlyEncoding::kBinary);
            !done)
            return tl::unexpected(done.error());
        progress(static_cast<double>(f + 1 - begin) / static_cast<double>(end - begin));
    }
    return end - begin;
}

}  // namespace

Expected<std::int64_t> export_clip(const ExportRequest& request, const std::atomic<bool>& stop,
                                   const std::function<void(double)>& progress) {
    return guarded(stop, [&] { return write_frames(request, stop, progress); });
}

}  // namespace batchenc
