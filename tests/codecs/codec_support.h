#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "codecs/clip_bitstream.h"
#include "codecs/clip_codec.h"
#include "kernels/crc32c.h"
#include "kernels/synthetic_clip.h"
#include "tests/support/sample_clips.h"

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

/// What the golden streams of RLPCA and ORLPCA hold.
inline MeshSequence golden_sheet() {
    return sheet(4, 3, 5, [](const std::array<double, 3>& p, double time) {
        return std::array<double, 3>{p[0] + time * p[1], p[1] - 0.25 * time * time, 0.5 * p[0] * p[1] * time};
    });
}

inline MeshSequence synthetic(const char* kind, std::int64_t vertices, std::int64_t frames) {
    const auto synthetic = make_synthetic_clip(kind, vertices, 1).value();
    MeshSequence clip;
    clip.vertex_count = synthetic->vertex_count();
    clip.frame_count = frames;
    clip.triangles = synthetic->triangles();
    clip.positions.resize(static_cast<std::size_t>(3 * clip.frame_count * clip.vertex_count));
    for (std::int64_t f = 0; f < clip.frame_count; ++f)
        synthetic->write_frame(f, {clip.view().at(f, 0), static_cast<std::size_t>(3 * clip.vertex_count)});
    return clip;
}

inline MeshSequence walker(std::int64_t vertices, std::int64_t frames) {
    return synthetic("walker", vertices, frames);
}

/// Some ranges of frames must be what the whole clip has there, and others refused. clip: of 37 frames.
inline void expect_any_range_decodes(std::span<const std::uint8_t> bytes, const MeshSequence& clip) {
    const SerialExecutor serial;
    ASSERT_EQ(clip.frame_count, 37);
    const MeshSequence whole = decode(clip, bytes);
    const auto decoded = decode_clip(bytes, clip.triangles, -1, kLimit, serial);
    ASSERT_TRUE(decoded);
    for (const auto& [begin, end] : {std::pair<std::int64_t, std::int64_t>{0, 1},
                                     {1, 2},
                                     {3, 4},
                                     {5, 21},
                                     {8, 16},
                                     {16, 18},
                                     {30, 37},
                                     {36, 37},
                                     {7, 7}}) {
        std::vector<float> part(static_cast<std::size_t>((end - begin) * clip.vertex_count * 3));
        ASSERT_TRUE((*decoded)->reconstruct(begin, {part.data(), end - begin, clip.vertex_count}, serial));
        const auto first = whole.positions.begin() + begin * clip.vertex_count * 3;
        EXPECT_TRUE(std::equal(part.begin(), part.end(), first)) << begin << " to " << end;
    }
    std::vector<float> part(static_cast<std::size_t>(3 * clip.vertex_count * 2));
    const auto outside = (*decoded)->reconstruct(36, {part.data(), 2, clip.vertex_count}, serial);
    ASSERT_FALSE(outside);
    EXPECT_EQ(outside.error().code, ErrorCode::kOutOfRange);
    EXPECT_FALSE((*decoded)->reconstruct(-1, {part.data(), 1, clip.vertex_count}, serial));
    EXPECT_FALSE((*decoded)->reconstruct(0, {part.data(), 1, clip.vertex_count - 1}, serial));
}

/// Root of the mean squared distance of the vertices.
inline double rmse(PositionsView a, PositionsView b) {
    double sum = 0.0;
    for (std::int64_t k = 0; k < a.value_count(); ++k) {
        const double d = static_cast<double>(a.data()[k]) - static_cast<double>(b.data()[k]);
        sum += d * d;
    }
    return std::sqrt(sum / static_cast<double>(a.frame_count() * a.vertex_count()));
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

// ---- hostile bytes ----

/// Every truncation, every flipped bit and an extra byte must be refused.
inline void expect_damage_is_refused(std::vector<std::uint8_t> bytes, const MeshSequence& like) {
    const SerialExecutor serial;
    const auto decodes = [&](std::span<const std::uint8_t> some) {
        return decode_clip(some, like.triangles, -1, kLimit, serial).has_value();
    };
    ASSERT_TRUE(decodes(bytes));
    for (std::size_t size = 0; size < bytes.size(); ++size) {
        const std::vector<std::uint8_t> shorter(
            bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size));  // fresh and exact
        EXPECT_FALSE(decodes(shorter)) << size;
    }
    for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
        bytes[bit / 8] ^= static_cast<std::uint8_t>(1u << (bit % 8));
        EXPECT_FALSE(decodes(bytes)) << "bit " << bit;
        bytes[bit / 8] ^= static_cast<std::uint8_t>(1u << (bit % 8));
    }
    bytes.push_back(0);
    EXPECT_FALSE(decodes(bytes));
}

/// Behind valid checksums every byte is still hostile: nothing may be read or written outside. Changes each
/// byte of every section in three ways; what decodes must reconstruct. Something must be refused.
inline void expect_changes_are_survived(std::span<const std::uint8_t> bytes, const MeshSequence& like) {
    const SerialExecutor serial;
    const CodecMethod method = parse_clip_bitstream(bytes)->method;
    const auto sections = sections_of(bytes);
    int refused = 0;
    for (std::size_t s = 0; s < sections.size(); ++s) {
        for (std::size_t at = 0; at < sections[s].second.size(); ++at) {
            for (const std::uint8_t change : {std::uint8_t{0x01}, std::uint8_t{0x80}, std::uint8_t{0xff}}) {
                auto changed = sections;
                changed[s].second[at] ^= change;
                const auto whole = write_clip_bitstream(method, like.vertex_count, like.frame_count, changed);
                const auto decoded = decode_clip(whole, like.triangles, -1, kLimit, serial);
                if (!decoded) {
                    ++refused;
                    continue;
                }
                std::vector<float> out(like.positions.size());
                EXPECT_TRUE(
                    (*decoded)->reconstruct(0, {out.data(), like.frame_count, like.vertex_count}, serial));
            }
        }
    }
    EXPECT_GT(refused, 0);
}

/// Counts that the bytes cannot hold, and memory that is not granted.
inline void expect_counts_and_memory_are_refused(std::span<const std::uint8_t> bytes,
                                                 const MeshSequence& like) {
    const SerialExecutor serial;
    const CodecMethod method = parse_clip_bitstream(bytes)->method;
    const auto sections = sections_of(bytes);
    for (const auto& [vertices, frames] :
         {std::pair<std::int64_t, std::int64_t>{2000000000, like.frame_count},
          {like.vertex_count, 2000000000},
          {20000000, like.frame_count}}) {
        const auto huge = write_clip_bitstream(method, vertices, frames, sections);
        EXPECT_FALSE(decode_clip(huge, like.triangles, -1, kLimit, serial)) << vertices << " x " << frames;
    }
    for (const std::int64_t limit : {0, 1000, 10000}) {
        const auto refused = decode_clip(bytes, like.triangles, -1, limit, serial);
        ASSERT_FALSE(refused) << limit;
        EXPECT_EQ(refused.error().code, ErrorCode::kLimit) << limit;
    }
    EXPECT_FALSE(decode_clip(bytes, std::vector<Triangle>{{0, 1, 500}}, -1, kLimit, serial));
}

// ---- what earlier versions wrote ----

/// Of the bits of all positions.
inline std::uint32_t checksum_of(const MeshSequence& clip) {
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(clip.positions.data());
    return crc32c({bytes, sizeof(float) * clip.positions.size()});
}

/// A clip of round numbers, the same on every machine.
inline MeshSequence golden_clip(std::int32_t nx, std::int32_t ny, std::int32_t frames) {
    MeshSequence clip = sheet(nx, ny, frames);
    for (std::int32_t f = 0; f < frames; ++f) {
        for (std::int32_t v = 0; v < nx * ny; ++v) {
            const std::int32_t x = v % nx, y = v / nx;
            float* p = clip.view().at(f, v);
            p[0] = static_cast<float>(16 * x + (x * y + 3 * f) % 5 + f * y) / 16.0f;
            p[1] = static_cast<float>(16 * y - f * f * x / 4) / 16.0f;
            p[2] = static_cast<float>(f * x * y / 2 + (x * x + y * f) % 7) / 16.0f;
        }
    }
    return clip;
}

}  // namespace batchenc::test
