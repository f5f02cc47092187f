#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <optional>

#include "core/error.h"

namespace batchenc {

struct ExportRequest {
    std::filesystem::path clip;             ///< source clip
    std::filesystem::path output;           ///< .obj, .off or .ply; of several frames its name has {frame}
    std::int64_t frame_begin = 0;           ///< first frame that is wanted
    std::optional<std::int64_t> frame_end;  ///< one past the last; nothing means to the end
    bool overwrite = false;
    bool ascii = false;  ///< .ply as text
};

/// Writes frames of a clip as meshes, one in memory at a time; {frame} in the name stands for the frame's
/// number in the clip, of four digits or as many as the last one has. Returns how many were written; after an
/// error those before it stay. progress is told the part that is done.
/// Errors: kOutOfRange (frames that the clip does not have), kInvalidArgument (several frames and no {frame},
/// an output that is the clip), kInterrupted, those of SourceClip and write_mesh.
Expected<std::int64_t> export_clip(const ExportRequest& request, const std::atomic<bool>& stop,
                                   const std::function<void(double)>& progress);

}  // namespace batchenc
