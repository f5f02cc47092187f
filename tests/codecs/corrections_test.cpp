#include "codecs/corrections.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include "codecs/rtpca_layout.h"
#include "kernels/byte_stream.h"
#include "tests/support/sample_clips.h"

namespace batchenc {
namespace {

constexpr std::int64_t kNoLimit = std::int64_t{1} << 40;

/// A clip, what a lossy coder might make of it, and the motion of its two clusters.
struct Scene {
    MeshSequence source, decoded;
    std::vector<std::int32_t> labels;
    std::vector<BodyTrack> tracks;
    FieldOrder order;
};

Scene make_scene(double noise) {
    Scene scene;
    scene.source = test::sheet(12, 9, 20);
    scene.decoded = scene.source;
    std::mt19937 random(1);
    std::normal_distribution<double> normal;
    const std::int64_t vertices = scene.source.vertex_count;
    std::vector<double> offset(static_cast<std::size_t>(3 * vertices));
    for (double& x : offset) x = noise * normal(random);
    for (std::int64_t f = 0; f < scene.source.frame_count; ++f) {
        for (std::int64_t k = 0; k < 3 * vertices; ++k) {
            double& x = offset[static_cast<std::size_t>(k)];
            x += 0.1 * noise * normal(random);  // errors last
            scene.decoded.view().at(f, 0)[k] += static_cast<float>(x);
        }
    }
    scene.labels.resize(static_cast<std::size_t>(vertices));
    for (std::size_t v = 0; v < scene.labels.size(); ++v) scene.labels[v] = v % 12 < 5 ? 0 : 1;
    for (int i = 0; i < 2; ++i) {
        BodyTrack track(static_cast<std::size_t>(scene.source.frame_count));
        for (std::size_t f = 0; f < track.size(); ++f)
            track[f].rotation = rotation_of({0.3 * i, 0.1 * static_cast<double>(f), -0.2});
        scene.tracks.push_back(track);
    }
    scene.order = FieldOrder::of_whole(MeshTopology(scene.source.triangles, vertices));
    return scene;
}

Expected<std::vector<std::uint8_t>> encode(const Scene& scene, double bound) {
    return encode_corrections(scene.source.view(), scene.decoded.view(), scene.order, scene.labels,
                              scene.tracks, bound);
}

Expected<Corrections> decode(const Scene& scene, std::span<const std::uint8_t> payload,
                             std::int64_t limit = kNoLimit) {
    return decode_corrections(payload, scene.order, scene.source.frame_count, limit);
}

TEST(Corrections, BringEveryVertexWithinTheBound) {
    for (const double noise : {1e-4, 0.01, 0.3}) {
        const Scene scene = make_scene(noise);
        std::size_t last = std::numeric_limits<std::size_t>::max();
        for (const double bound : {1e-4, 0.003, 0.1}) {
            const auto payload = encode(scene, bound);
            ASSERT_TRUE(payload) << payload.error().to_string();
            EXPECT_LE(payload->size(), last);
            last = payload->size();
            EXPECT_EQ(*read_bound(*payload), bound);
            const auto corrections = decode(scene, *payload);
            ASSERT_TRUE(corrections) << corrections.error().to_string();
            MeshSequence mended = scene.decoded;
            corrections->apply(0, mended.view(), scene.labels, scene.tracks);
            EXPECT_LE(test::largest_distance(scene.source.view(), mended.view()), bound);
            // Any range of frames is that of the whole.
            MeshSequence part = scene.decoded;
            const std::int64_t begin = 7, end = 12;
            const MutablePositionsView some(part.view().at(begin, 0), end - begin, part.vertex_count);
            corrections->apply(begin, some, scene.labels, scene.tracks);
            EXPECT_EQ(std::memcmp(some.data(), mended.view().at(begin, 0),
                                  static_cast<std::size_t>(PositionsView(some).size_bytes())),
                      0);
        }
    }
}

TEST(Corrections, AreFewBytesWhereNothingIsWrong) {
    Scene scene = make_scene(0.0);
    const auto payload = encode(scene, 1e-3);
    ASSERT_TRUE(payload);
    EXPECT_LE(payload->size(), sizeof(double) + 2);
    EXPECT_TRUE(decode(scene, *payload)->empty());
}

// An offset of 2 and -1 steps along the axes of a body that has turned a quarter about z.
TEST(Corrections, HandWorked) {
    const double bound = 0.1;
    const auto step = static_cast<double>(static_cast<float>(bound * 2.0 / std::sqrt(3.0) * (511.0 / 512.0)));
    std::vector<BodyTrack> tracks(1, BodyTrack(4));
    for (BodyMotion& motion : tracks[0]) motion.rotation = {0, -1, 0, 1, 0, 0, 0, 0, 1};
    const std::vector<std::int32_t> labels(2, 0);
    const std::vector<Correction> list = {{1, 1, {2, -1, 0}}, {3, 1, {0, 0, 3}}};
    const Corrections corrections(list, bound, 2);
    EXPECT_FALSE(corrections.empty());
    std::vector<float> places(4 * 2 * 3, 1.0f);
    corrections.apply(0, {places.data(), 4, 2}, labels, tracks);
    const auto expect_place = [&](std::size_t frame, std::size_t vertex, double x, double y, double z) {
        const float* p = places.data() + 3 * (2 * frame + vertex);
        EXPECT_NEAR(p[0], 1.0 + x * step, 1e-6);
        EXPECT_NEAR(p[1], 1.0 + y * step, 1e-6);
        EXPECT_NEAR(p[2], 1.0 + z * step, 1e-6);
    };
    for (std::size_t f = 0; f < 4; ++f) expect_place(f, 0, 0, 0, 0);
    expect_place(0, 1, 0, 0, 0);
    expect_place(1, 1, 1, 2, 0);
    expect_place(2, 1, 1, 2, 0);
    expect_place(3, 1, 0, 0, 3);
}

TEST(Corrections, RefuseWhatFloat32CannotHold) {
    Scene scene = make_scene(0.01);
    for (MeshSequence* clip : {&scene.source, &scene.decoded}) {
        for (float& x : clip->positions) x += 30000.0f;
    }
    const auto refused = encode(scene, 1e-12);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::kLimit);
    EXPECT_TRUE(encode(scene, 1e-5));  // each place that a source has can be reached
}

TEST(Corrections, RefuseBoundsThatMakeNoSense) {
    const double infinity = std::numeric_limits<double>::infinity();
    for (const double bound : {0.0, -1.0, infinity, -infinity, 1e39, 1e300, std::nan("")}) {
        ByteWriter out;
        out.put(bound);
        const auto read = read_bound(out.bytes());
        ASSERT_FALSE(read) << bound;
        EXPECT_EQ(read.error().code, ErrorCode::kCorrupt);
    }
    EXPECT_FALSE(read_bound(std::vector<std::uint8_t>(7)));
}

TEST(Corrections, RefuseDamage) {
    const Scene scene = make_scene(0.02);
    auto payload = encode(scene, 0.004).value();
    ASSERT_TRUE(decode(scene, payload));
    payload.push_back(0);
    EXPECT_FALSE(decode(scene, payload));
    payload.pop_back();
    // Other bytes are other changes, which end elsewhere but for a few; none may crash.
    std::size_t accepted = 0, tried = 0;
    const auto take = [&](std::span<const std::uint8_t> bytes) {
        ++tried;
        const auto decoded = decode(scene, bytes);
        if (!decoded) return;
        ++accepted;
        MeshSequence out = scene.decoded;
        decoded->apply(0, out.view(), scene.labels, scene.tracks);
    };
    for (std::size_t size = 0; size < payload.size(); size += size + 20 < payload.size() ? 7 : 1)
        take(std::span(payload).first(size));
    for (std::size_t at = sizeof(double); at < payload.size(); at += 5) {
        payload[at] ^= 0x10;
        take(payload);
        payload[at] ^= 0x10;
    }
    EXPECT_LT(accepted, tried / 20);
    const auto refused = decode(scene, payload, 1000);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::kLimit);
}

}  // namespace
}  // namespace batchenc
