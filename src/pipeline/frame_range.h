#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "core/error.h"
#include "io/result_file.h"

namespace batchenc {

/// Frames [begin, end) of a file, a clip or a result as `kind` says; nothing for `end` means to its last.
/// Error: kOutOfRange where the file does not have them, or none is left.
inline Expected<ClipSpan> frames_of(const char* kind, const std::filesystem::path& file,
                                    std::int64_t frame_count, std::int64_t begin,
                                    std::optional<std::int64_t> end) {
    const std::int64_t last = end.value_or(frame_count);
    if (begin >= 0 && begin < last && last <= frame_count) return ClipSpan{begin, last - begin};
    return fail(ErrorCode::kOutOfRange,
                "frames [" + std::to_string(begin) + ", " + std::to_string(last) + ") of a " + kind + " of " +
                    std::to_string(frame_count),
                file.string());
}

}  // namespace batchenc
