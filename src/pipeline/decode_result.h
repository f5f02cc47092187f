#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <optional>

#include "core/error.h"
#include "core/executor.h"

namespace batchenc {

struct DecodeRequest {
    std::filesystem::path result;
    std::filesystem::path output;           ///< source clip to be written
    std::int64_t frame_begin = 0;           ///< first frame of the result that is wanted
    std::optional<std::int64_t> frame_end;  ///< one past the last; nothing means to the end
    std::int32_t components = -1;           ///< principal components to use; negative for all
    bool overwrite = false;
    std::int64_t memory_bytes = 0;  ///< bound on what is allocated, whatever the result claims
};

struct DecodeReport {
    std::int64_t frame_count = 0;
    std::int64_t vertex_count = 0;
    std::int64_t triangle_count = 0;
    double time_s = 0.0;  ///< from opening the result to closing the clip
};

/// Decodes a result, or some of its frames, into a clip file, a block of frames at a time. The file appears
/// whole or not at all. progress is told the part that is done, from 0 to 1.
/// Errors: kOutOfRange (frames that the result does not have), kExists, kInvalidArgument (output is the
/// result itself), kInterrupted, those of ResultDecoder and ClipWriter.
Expected<DecodeReport> decode_result(const DecodeRequest& request, const Executor& executor,
                                     const std::atomic<bool>& stop,
                                     const std::function<void(double)>& progress);

}  // namespace batchenc
