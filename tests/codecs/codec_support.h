#pragma once

#include <gtest/gtest.h>

#include <limits>

#include "codecs/clip_bitstream.h"
#include "codecs/clip_codec.h"
#include "kernels/synthetic_clip.h"

namespace batchenc::test {

// What tests of coders have in common.

inline constexpr std::int64_t kLimit = std::int64_t{1} << 30;

inline MeshSequence decode(const MeshSequence& like, std::span<const std::uint8_t> bitstream,
                           const Executor& executor = SerialExecutor()) {
    MeshSequence decoded = like;
    std::fill(decoded.positions.begin(), decoded.positions.end(), std::numeric_limits<float>::quiet_NaN());
    const auto clip = decode_clip(bitstream, like.triangles, -1, kLimit, executor);
    EXPECT_TRUE(clip) << clip.error().to_string();
    if (clip) {
        EXPECT_TRUE((*clip)->reconstruct(0, decoded.view(), executor));
    }
    return decoded;
}

inline MeshSequence walker(std::int64_t vertices, std::int64_t frames) {
    const auto synthetic = make_synthetic_clip("walker", vertices, 1).value();
    MeshSequence clip;
    clip.vertex_count = synthetic->vertex_count();
    clip.frame_count = frames;
    clip.triangles = synthetic->triangles();
    clip.positions.resize(static_cast<std::size_t>(3 * clip.frame_count * clip.vertex_count));
    for (std::int64_t f = 0; f < clip.frame_count; ++f)
        synthetic->write_frame(f, {clip.view().at(f, 0), static_cast<std::size_t>(3 * clip.vertex_count)});
    return clip;
}

/// The sections of a bitstream, to be changed and written again.
inline std::vector<SectionPayload> sections_of(std::span<const std::uint8_t> bytes) {
    const auto clip = *parse_clip_bitstream(bytes);
    std::vector<SectionPayload> sections;
    for (std::size_t i = 0; i < kSectionCount; ++i)
        sections.emplace_back(static_cast<SectionId>(i + 1),
                              std::vector<std::uint8_t>(clip.payloads[i].begin(), clip.payloads[i].end()));
    return sections;
}

}  // namespace batchenc::test
