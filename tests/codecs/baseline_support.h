#pragma once

#include <gtest/gtest.h>

#include <cmath>

#include "codecs/segmentation.h"
#include "kernels/bounding_box.h"
#include "tests/codecs/codec_support.h"
#include "tests/support/thread_executor.h"

namespace batchenc::test {

// What tests of baselines have in common. clusters: of coders that have any.

inline Expected<EncodedClip> try_to_encode(const MeshSequence& clip, const CodecParameters& parameters,
                                           std::int32_t clusters = 4,
                                           const Executor& executor = SerialExecutor()) {
    Segmentation segmentation;
    if (uses_clusters(parameters.method)) {
        auto found = segment_clip(clip.view(), clip.triangles, {.clusters = clusters}, executor);
        if (!found) return tl::unexpected(found.error());
        segmentation = std::move(*found);
    }
    return encode_clip(clip.view(), clip.triangles, segmentation, parameters, executor);
}

/// A stream whose sections sum to its size; none where it failed, which is then a failure of the test.
inline std::vector<std::uint8_t> encode(const MeshSequence& clip, const CodecParameters& parameters,
                                        std::int32_t clusters = 4,
                                        const Executor& executor = SerialExecutor()) {
    const auto encoded = try_to_encode(clip, parameters, clusters, executor);
    EXPECT_TRUE(encoded) << encoded.error().to_string();
    if (!encoded) return {};
    EXPECT_EQ(encoded->section_bytes.total(), static_cast<std::int64_t>(encoded->bitstream.size()));
    return encoded->bitstream;
}

/// From the first components alone.
inline MeshSequence decode_components(const MeshSequence& like, std::span<const std::uint8_t> bytes,
                                      std::int32_t components) {
    MeshSequence decoded = like;
    const SerialExecutor serial;
    const auto clip = decode_clip(bytes, like.triangles, components, kLimit, serial);
    EXPECT_TRUE(clip) << clip.error().to_string();
    if (clip) {
        EXPECT_TRUE((*clip)->reconstruct(0, decoded.view(), serial));
    }
    return decoded;
}

/// e_max.
inline double side_of(const MeshSequence& clip) { return bounding_box(clip.view()).largest_side(); }

/// A step of e_max / 2^bits.
inline double step_of(const MeshSequence& clip, std::int32_t bits) {
    return std::ldexp(side_of(clip), -bits);
}

/// How large the numbers are that float32 rounds: e_max and how far the box' centre is away.
inline double extent_of(const MeshSequence& clip) {
    const BoundingBox box = bounding_box(clip.view());
    double extent = box.largest_side();
    for (const float value : box.center()) extent += std::abs(static_cast<double>(value));
    return extent;
}

/// Of what is decoded from a stream of the clip.
inline double rmse_of(const MeshSequence& clip, std::span<const std::uint8_t> bytes) {
    return rmse(clip.view(), decode(clip, bytes).view());
}
inline double largest_distance_of(const MeshSequence& clip, std::span<const std::uint8_t> bytes) {
    return largest_distance(clip.view(), decode(clip, bytes).view());
}

// ---- what holds for every baseline, or for some ----

/// Three bits more must at least halve the error, and cost. Gives the error at 15 bits.
inline double expect_bits_help(const MeshSequence& clip, CodecParameters parameters,
                               std::int32_t clusters = 4) {
    double last = 1e9;
    std::size_t size = 0;
    for (const std::int32_t bits : {6, 9, 12, 15}) {
        parameters.bits = bits;
        const auto bytes = encode(clip, parameters, clusters);
        const double error = rmse_of(clip, bytes);
        EXPECT_LT(error, last / 2) << bits;
        EXPECT_GT(bytes.size(), size) << bits;
        last = error;
        size = bytes.size();
    }
    return last;
}

/// Every number of components, each above the one before, must give less error; as many as asked, all.
inline void expect_components_help(const MeshSequence& clip, std::span<const std::uint8_t> bytes,
                                   std::initializer_list<std::int32_t> counts) {
    double last = 1e9;
    for (const std::int32_t components : counts) {
        const double error = rmse(clip.view(), decode_components(clip, bytes, components).view());
        EXPECT_LT(error, last) << components;
        last = error;
    }
    EXPECT_EQ(decode_components(clip, bytes, 9999).positions, decode(clip, bytes).positions);
}

/// In any order and by any number of threads the same bytes, and the same positions of them.
inline void expect_same_for_any_executor(const MeshSequence& clip, const CodecParameters& parameters,
                                         std::int32_t clusters = 4) {
    const auto bytes = encode(clip, parameters, clusters);
    const MeshSequence decoded = decode(clip, bytes);
    const auto expect_same = [&](const Executor& executor) {
        EXPECT_EQ(encode(clip, parameters, clusters, executor), bytes);
        EXPECT_EQ(decode(clip, bytes, executor).positions, decoded.positions);
    };
    for (const std::uint64_t seed : {0u, 1u, 2u, 5u, 7u}) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        expect_same(ShuffledExecutor(seed));
    }
    for (const int threads : {3, 4}) {
        SCOPED_TRACE(std::to_string(threads) + " threads");
        expect_same(ThreadExecutor(threads));
    }
}

/// Sizes that float32 holds, but not their squares or sums: refused, never written as if it were well.
inline void expect_refused_or_close(const CodecParameters& parameters, std::int32_t clusters = 4) {
    for (const double size : {1e-30, 1e-12, 1e12, 1e18, 1e37, 1.6e38}) {
        const MeshSequence clip = sheet(8, 8, 12, [size](const std::array<double, 3>& p, double time) {
            const auto q = bend(p, time);
            return std::array<double, 3>{0.2 * size * q[0], 0.2 * size * q[1], 0.2 * size * q[2]};
        });
        const auto encoded = try_to_encode(clip, parameters, clusters);
        if (encoded) {
            EXPECT_LE(largest_distance_of(clip, encoded->bitstream), 0.02 * side_of(clip)) << size;
        } else {
            EXPECT_TRUE(size < 1e-20 || size > 1e20) << size << ": " << encoded.error().to_string();
        }
    }
}

/// Hostile bytes of a mesh, and of points alone.
inline void expect_changes_are_survived(MeshSequence clip, const CodecParameters& parameters,
                                        std::int32_t clusters = 4) {
    expect_changes_are_survived(encode(clip, parameters, clusters), clip);
    clip.triangles.clear();
    expect_changes_are_survived(encode(clip, parameters, clusters), clip);
}

/// A stream of two frames that says it had one.
inline void expect_motion_of_a_single_frame_is_refused(const CodecParameters& parameters,
                                                       std::int32_t clusters = 4) {
    const SerialExecutor serial;
    const MeshSequence two = sheet(4, 3, 2);
    const auto whole = write_clip_bitstream(parameters.method, two.vertex_count, 1,
                                            sections_of(encode(two, parameters, clusters)));
    const auto decoded = decode_clip(whole, two.triangles, -1, kLimit, serial);
    ASSERT_FALSE(decoded);
    EXPECT_EQ(decoded.error().code, ErrorCode::kCorrupt);
}

}  // namespace batchenc::test
