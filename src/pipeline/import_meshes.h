#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "core/error.h"

namespace batchenc {

struct ImportRequest {
    std::vector<std::filesystem::path> meshes;  ///< a frame each, in this order
    std::filesystem::path output;               ///< source clip to be written
    double fps = 0.0;                           ///< 0: the clip does not say
    std::string name;
    bool overwrite = false;
};

struct ImportReport {
    std::int64_t frame_count = 0;
    std::int64_t vertex_count = 0;
    std::int64_t triangle_count = 0;
    std::int64_t polygon_count = 0;  ///< faces of more than three corners in the first mesh, now triangles
    std::int64_t ignored_count = 0;  ///< faces of fewer
};

/// Makes a source clip of meshes, a frame each; order and count of vertices stay. One mesh is in memory at a
/// time beside the first. All must have as many vertices and the same faces. progress is told the part that
/// is done. Errors: kInvalidArgument (no meshes, an output that is one of them), kFormat (a mesh that differs
/// from the first, naming it and how), kInterrupted, those of read_mesh and ClipWriter.
Expected<ImportReport> import_meshes(const ImportRequest& request, const std::atomic<bool>& stop,
                                     const std::function<void(double)>& progress);

}  // namespace batchenc
