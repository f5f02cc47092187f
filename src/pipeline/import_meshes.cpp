#include "pipeline/import_meshes.h"

#include "io/mesh/mesh_file.h"
#include "io/source_clip.h"
#include "pipeline/guarded.h"

namespace batchenc {

namespace {

std::string to_text(const Triangle& t) {
    return "(" + std::to_string(t[0]) + ", " + std::to_string(t[1]) + ", " + std::to_string(t[2]) + ")";
}

/// How a mesh differs from the first one, in words; empty where it does not.
std::string difference(const Mesh& first, const Mesh& mesh) {
    if (mesh.vertex_count() != first.vertex_count())
        return std::to_string(mesh.vertex_count()) + " vertices, not " + std::to_string(first.vertex_count());
    if (mesh.triangles.size() != first.triangles.size())
        return std::to_string(mesh.triangles.size()) + " triangles, not " +
               std::to_string(first.triangles.size());
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        if (mesh.triangles[t] != first.triangles[t])
            return to_text(mesh.triangles[t]) + " for triangle " + std::to_string(t) + ", not " +
                   to_text(first.triangles[t]);
    }
    return {};
}

Expected<ImportReport> import(const ImportRequest& request, const std::atomic<bool>& stop,
                              const std::function<void(double)>& progress) {
    if (request.meshes.empty()) return fail(ErrorCode::kInvalidArgument, "there is no mesh to import");
    std::error_code ignored;  // a path that cannot be looked up is no other's twin
    for (const auto& path : request.meshes) {
        if (std::filesystem::equivalent(path, request.output, ignored))
            return fail(ErrorCode::kInvalidArgument, "the output is one of the meshes", path.string());
    }
    const auto frame_count = static_cast<std::int64_t>(request.meshes.size());
    const auto first = read_mesh(request.meshes[0]);
    if (!first) return tl::unexpected(first.error());
    auto writer = ClipWriter::create(request.output, frame_count, first->vertex_count(), first->triangles,
                                     request.fps, request.name, request.overwrite);
    if (!writer) return tl::unexpected(writer.error());
    for (std::int64_t f = 0; f < frame_count; ++f) {
        if (stop.load(std::memory_order_relaxed)) throw Interrupted{};
        Expected<Mesh> later;
        if (f > 0) {
            later = read_mesh(request.meshes[static_cast<std::size_t>(f)]);
            if (!later) return tl::unexpected(later.error());
            if (const std::string what = difference(*first, *later); !what.empty())
                return fail(ErrorCode::kFormat, "has " + what + " as " + request.meshes[0].string(),
                            request.meshes[static_cast<std::size_t>(f)].string());
        }
        const Mesh& mesh = f > 0 ? *later : *first;
        if (auto done = (*writer)->write_frames(f, {mesh.positions.data(), 1, mesh.vertex_count()}); !done)
            return tl::unexpected(done.error());
        progress(static_cast<double>(f + 1) / static_cast<double>(frame_count));
    }
    if (auto done = (*writer)->finish(); !done) return tl::unexpected(done.error());
    return ImportReport{frame_count, first->vertex_count(),
                        static_cast<std::int64_t>(first->triangles.size()), first->polygon_count,
                        first->ignored_count};
}

}  // namespace

Expected<ImportReport> import_meshes(const ImportRequest& request, const std::atomic<bool>& stop,
                                     const std::function<void(double)>& progress) {
    return guarded(stop, [&] { return import(request, stop, progress); });
}

}  // namespace batchenc
