#pragma once

#include <atomic>
#include <filesystem>
#include <optional>

#include "codecs/segmentation.h"
#include "core/error.h"
#include "core/executor.h"

namespace batchenc {

struct SegmentRequest {
    std::filesystem::path source;           ///< source clip
    std::filesystem::path output;           ///< file of labels to be written
    std::filesystem::path ply;              ///< coloured mesh of the first frame to be written; empty: none
    std::int64_t frame_begin = 0;           ///< first frame to look at
    std::optional<std::int64_t> frame_end;  ///< one past the last; nothing means to the end
    SegmentationParameters parameters;
    bool overwrite = false;
    std::int64_t memory_bytes = 0;  ///< a clip that needs more is refused
};

struct SegmentReport {
    Segmentation segmentation;
    std::int64_t frame_count = 0;
    std::int64_t vertex_count = 0;
    double time_s = 0.0;  ///< of segmentation alone, files apart
};

/// Segments a clip, or some of its frames, as a job would segment a clip of these frames, and writes labels
/// and picture. Each file appears whole or not at all.
/// Errors: kOutOfRange (frames that the clip does not have), kLimit (memory), kExists, kInvalidArgument (an
/// output is the source, or both outputs are one), kInterrupted, those of SourceClip and segment_clip.
Expected<SegmentReport> segment_source(const SegmentRequest& request, const Executor& executor,
                                       const std::atomic<bool>& stop);

}  // namespace batchenc
