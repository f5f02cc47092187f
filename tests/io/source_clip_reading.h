#pragma once

#include <gtest/gtest.h>

#include <vector>

#include "io/source_clip.h"

namespace batchenc::testing {

/// Frames [begin, begin + count) of a clip, which have to be readable.
inline std::vector<float> read_range(SourceClip& clip, std::int64_t begin, std::int64_t count,
                                     const Executor& executor = SerialExecutor()) {
    std::vector<float> values(static_cast<std::size_t>(count * clip.vertex_count() * 3), -1.0F);
    const auto read = clip.read_frames(begin, {values.data(), count, clip.vertex_count()}, executor);
    EXPECT_TRUE(read) << read.error().to_string();
    return values;
}

/// The same frames of values that are in memory.
inline std::vector<float> part_of(const std::vector<float>& values, std::int64_t begin, std::int64_t count,
                                  std::int64_t vertices) {
    const auto first = values.begin() + begin * vertices * 3;
    return {first, first + count * vertices * 3};
}

}  // namespace batchenc::testing
