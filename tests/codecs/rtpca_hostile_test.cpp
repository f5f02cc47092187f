#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "codecs/clip_bitstream.h"
#include "codecs/clip_codec.h"
#include "codecs/rtpca_layout.h"
#include "kernels/byte_stream.h"
#include "tests/codecs/codec_support.h"
#include "tests/support/sample_clips.h"

namespace batchenc {
namespace {

using test::kLimit, test::sections_of;
const SerialExecutor kSerial;

std::vector<std::uint8_t> encode(const MeshSequence& clip, std::int32_t clusters, double step,
                                 double max_error_relative = 0.0) {
    SegmentationParameters segmentation_parameters;
    segmentation_parameters.clusters = clusters;
    const auto segmentation = segment_clip(clip.view(), clip.triangles, segmentation_parameters, kSerial);
    CodecParameters parameters;
    parameters.method = CodecMethod::kRtpca;
    parameters.step = step;
    parameters.max_error_relative = max_error_relative;
    const auto encoded = encode_clip(clip.view(), clip.triangles, *segmentation, parameters, kSerial);
    EXPECT_TRUE(encoded) << encoded.error().to_string();
    return encoded ? encoded->bitstream : std::vector<std::uint8_t>();
}

// ---- what both sides derive ----

TEST(RtpcaLayout, HeaderComesBackAndSteps) {
    RtpcaHeader header;
    header.step = 0.25f;
    header.e_max = 2.0f;
    header.center = {1, -2, 3};
    header.cluster_count = 7;
    header.component_count = 300;
    const auto read = RtpcaHeader::read(header.write(), 7);
    ASSERT_TRUE(read);
    EXPECT_EQ(read->step, 0.25f);
    EXPECT_EQ(read->e_max, 2.0f);
    EXPECT_EQ(read->center, header.center);
    EXPECT_EQ(read->cluster_count, 7);
    EXPECT_EQ(read->component_count, 300);
    EXPECT_FALSE(RtpcaHeader::read(header.write(), 6));  // more clusters than vertices
    EXPECT_EQ(header.shape_step(1), 0.25f);
    EXPECT_EQ(header.shape_step(4), 0.125f);
    EXPECT_EQ(header.body_step(0), 0.25f);
    header.step = 1e-9f;
    EXPECT_EQ(header.body_step(100), 2.0f * 0x1p-24f);  // no finer than float32 holds
    EXPECT_FLOAT_EQ((RtpcaComponent{0, 0}.basis_step()), 1.25f);
    EXPECT_FLOAT_EQ((RtpcaComponent{0, 8}.basis_step()), 1.25f / 4.0f);
    for (const std::int32_t scale : {1, 2, 3, 7, 101, 255})
        EXPECT_NEAR(RtpcaComponent({0, scale}).basis_step() * std::exp2(0.25 * scale), 1.25, 1e-6) << scale;
}

TEST(RtpcaLayout, RefusesHeadersThatMakeNoSense) {
    RtpcaHeader good;
    good.step = good.e_max = 1.0f;
    good.cluster_count = 2;
    const auto refused = [&](auto change) {
        RtpcaHeader header = good;
        change(header);
        const auto read = RtpcaHeader::read(header.write(), 100);
        return !read && read.error().code == ErrorCode::kCorrupt;
    };
    const float nan = std::numeric_limits<float>::quiet_NaN(),
                infinity = std::numeric_limits<float>::infinity();
    EXPECT_FALSE(refused([](RtpcaHeader&) {}));
    for (const float bad : {-1.0f, nan, infinity}) {
        EXPECT_TRUE(refused([&](RtpcaHeader& h) { h.step = bad; }));
        EXPECT_TRUE(refused([&](RtpcaHeader& h) { h.e_max = bad; }));
    }
    EXPECT_TRUE(refused([&](RtpcaHeader& h) { h.center[1] = nan; }));
    EXPECT_TRUE(refused([&](RtpcaHeader& h) { h.cluster_count = 0; }));
    EXPECT_TRUE(refused([&](RtpcaHeader& h) { h.cluster_count = 101; }));
    EXPECT_TRUE(refused([&](RtpcaHeader& h) { h.component_count = (std::int64_t{1} << 31) + 1; }));
    auto bytes = good.write();
    bytes.push_back(0);
    EXPECT_FALSE(RtpcaHeader::read(bytes, 100));
}

/// Bodies that hang on these parents and stand still.
std::vector<CodedBody> still_bodies(std::span<const std::int32_t> parents, std::int64_t frames) {
    std::vector<CodedBody> bodies(parents.size());
    for (std::size_t i = 0; i < bodies.size(); ++i) {
        bodies[i].parent = parents[i];
        bodies[i].radius = static_cast<std::int32_t>(5 * i) % 49;
        bodies[i].joint = {static_cast<std::int32_t>(i), -1000, 1 << 20};
        bodies[i].rotation.form = TrackForm::kSlopes;
        bodies[i].rotation.values.assign(static_cast<std::size_t>(3 * frames), static_cast<std::int32_t>(i));
        bodies[i].path.form = TrackForm::kBlocks8;
        bodies[i].path.values.assign(static_cast<std::size_t>(3 * frames), 0);
    }
    return bodies;
}

std::vector<std::uint8_t> coded(std::vector<CodedBody> bodies, std::int64_t frames) {
    BitCoder coder;
    EXPECT_TRUE(code_bodies(coder, bodies, frames));
    return coder.finish();
}

TEST(RtpcaLayout, BodiesComeBack) {
    const std::vector<std::int32_t> parents = {-1, 0, 0, 2, -1, 3, 5};
    const std::vector<CodedBody> bodies = still_bodies(parents, 21);
    const auto bytes = coded(bodies, 21);
    std::vector<CodedBody> read(bodies.size());
    for (CodedBody& body : read) {
        body.rotation.values.resize(63);
        body.path.values.resize(63);
    }
    BitCoder coder(bytes);
    ASSERT_TRUE(code_bodies(coder, read, 21));
    EXPECT_TRUE(coder.check_end());
    for (std::size_t i = 0; i < bodies.size(); ++i) {
        EXPECT_EQ(read[i].parent, bodies[i].parent);
        EXPECT_EQ(read[i].radius, bodies[i].radius);
        EXPECT_EQ(read[i].joint, bodies[i].joint);
        EXPECT_EQ(read[i].rotation.values, bodies[i].rotation.values);
        EXPECT_EQ(read[i].path.form, bodies[i].path.form);
        EXPECT_EQ(read[i].path.values, bodies[i].path.values);
    }
}

// The joint goes along its path, whatever the rotation; a child's does in the frame of its parent.
TEST(RtpcaLayout, JointsFollowTheirPaths) {
    RtpcaHeader header;
    header.step = 0.5f;
    header.e_max = 4096.0f;
    header.cluster_count = 2;
    CodedBody body;
    body.joint = {3, -2, 1};
    body.radius = 3;
    body.rotation.values = {100, 200, 300, 400, 0, -100};  // x of two frames, y, z
    body.path.values = {6, 8, -2, -2, 0, 40};
    const TrackTransform transform(2);
    EXPECT_EQ(body.joint_place(header), (std::array<double, 3>{3, -2, 1}));
    const double r = 4096.0 * std::exp2(-1.5);
    EXPECT_NEAR(body.rotation_step(header, 4), 0.25 / r * std::sqrt(1.5), 1e-12);
    const BodyTrack world = body.track(nullptr, header, 4, transform);
    ASSERT_EQ(world.size(), 2u);
    const auto place = world[1].apply({3, -2, 1});
    EXPECT_NEAR(place[0], 8 * 0.25, 1e-9);
    EXPECT_NEAR(place[1], -2 * 0.25, 1e-9);
    EXPECT_NEAR(place[2], 40 * 0.25, 1e-9);
    const double turn = body.rotation_step(header, 4);
    EXPECT_EQ(world[1].rotation, rotation_of({200 * turn, 400 * turn, -100 * turn}));
    const BodyTrack child = body.track(&world, header, 4, transform);
    const auto at = child[1].apply({3, -2, 1}), expected = world[1].apply({2, -0.5, 10});
    for (std::size_t axis = 0; axis < 3; ++axis) EXPECT_NEAR(at[axis], expected[axis], 1e-9);
}

TEST(RtpcaLayout, ListsOfComponentsComeBack) {
    for (const std::int32_t clusters : {1, 2, 5, 300}) {
        std::vector<RtpcaComponent> list;
        for (std::int32_t k = 0; k < 200; ++k)
            list.push_back({k * 37 % clusters, std::max(0, RtpcaComponent::kLargestScale - 2 * k + k % 2)});
        std::stable_sort(list.begin(), list.end(),
                         [](const auto& a, const auto& b) { return a.scale > b.scale; });
        BitCoder coder;
        std::vector<RtpcaComponent> copy = list;
        ASSERT_TRUE(code_components(coder, copy, clusters));
        const auto bytes = coder.finish();
        BitCoder decoder(bytes);
        std::vector<RtpcaComponent> read(list.size());
        ASSERT_TRUE(code_components(decoder, read, clusters));
        EXPECT_TRUE(decoder.check_end());
        for (std::size_t k = 0; k < list.size(); ++k) {
            EXPECT_EQ(read[k].cluster, list[k].cluster);
            EXPECT_EQ(read[k].scale, list[k].scale);
        }
    }
}

// ---- hostile bytes ----

TEST(RtpcaHostile, EveryTruncationAndFlippedBitAndExtraByteIsRefused) {
    const MeshSequence clip = test::sheet(5, 4, 6);
    test::expect_damage_is_refused(encode(clip, 3, 1e-2, 1e-2), clip);
}

TEST(RtpcaHostile, ChangesBehindValidChecksumsAreSurvived) {
    MeshSequence clip = test::sheet(6, 5, 9);
    for (const bool points : {false, true}) {
        if (points) clip.triangles.clear();
        test::expect_changes_are_survived(encode(clip, 3, 1e-2), clip);
        test::expect_changes_are_survived(encode(clip, 2, 1e-2, 5e-3), clip);
    }
}

TEST(RtpcaHostile, CountsAndMemoryAreRefusedBeforeAllocating) {
    const MeshSequence clip = test::sheet(10, 9, 20);
    test::expect_counts_and_memory_are_refused(encode(clip, 3, 1e-4), clip);
}

// A few bytes less are other values, which rarely end where the bytes do.
TEST(RtpcaHostile, TruncatedSectionsAreRefusedOrAreAClip) {
    const MeshSequence clip = test::sheet(6, 5, 9);
    const auto sections = sections_of(encode(clip, 3, 1e-2, 5e-3));
    for (std::size_t s = 0; s < sections.size(); ++s) {
        std::size_t accepted = 0;
        for (std::size_t size = 0; size < sections[s].second.size(); ++size) {
            auto changed = sections;
            changed[s].second.resize(size);
            const auto bytes =
                write_clip_bitstream(CodecMethod::kRtpca, clip.vertex_count, clip.frame_count, changed);
            const auto decoded = decode_clip(bytes, clip.triangles, -1, kLimit, kSerial);
            if (!decoded) continue;
            ++accepted;
            std::vector<float> out(clip.positions.size());
            EXPECT_TRUE(
                (*decoded)->reconstruct(0, {out.data(), clip.frame_count, clip.vertex_count}, kSerial));
        }
        EXPECT_LE(accepted, 5 + sections[s].second.size() / 8) << "section " << s + 1;
    }
}

Expected<std::unique_ptr<DecodedClip>> with_section(const MeshSequence& clip,
                                                    std::span<const std::uint8_t> bytes, SectionId id,
                                                    std::vector<std::uint8_t> payload) {
    auto sections = sections_of(bytes);
    sections[static_cast<std::size_t>(id) - 1].second = std::move(payload);
    return decode_clip(
        write_clip_bitstream(CodecMethod::kRtpca, clip.vertex_count, clip.frame_count, sections),
        clip.triangles, -1, kLimit, kSerial);
}

TEST(RtpcaHostile, CyclesOfParentsAreRefused) {
    const MeshSequence clip = test::sheet(6, 5, 9);
    const auto bytes = encode(clip, 3, 1e-2);
    ASSERT_EQ(read_clip_info(bytes)->cluster_count, 3);
    const auto decoded_with = [&](std::vector<std::int32_t> parents) {
        return with_section(clip, bytes, SectionId::kFrames, coded(still_bodies(parents, 9), 9));
    };
    EXPECT_TRUE(decoded_with({-1, 2, 0}));
    for (const auto& parents : {std::vector<std::int32_t>{0, -1, -1}, {1, 0, -1}, {1, 2, 0}}) {
        const auto refused = decoded_with(parents);
        ASSERT_FALSE(refused);
        EXPECT_EQ(refused.error().code, ErrorCode::kCorrupt);
    }
}

// Motions may be anything that a stream can say: they end in places, finite or not.
TEST(RtpcaHostile, HugeMotionsEndInAClip) {
    const MeshSequence clip = test::sheet(6, 5, 9);
    const auto bytes = encode(clip, 3, 1e-2);
    auto bodies = still_bodies(std::vector<std::int32_t>{-1, 0, 1}, 9);
    for (CodedBody& body : bodies) {
        body.joint = {1 << 30, -(1 << 30), 1 << 30};
        for (std::int32_t& value : body.rotation.values) value = 1 << 29;
        for (std::int32_t& value : body.path.values) value = -(1 << 29);
    }
    const auto decoded = with_section(clip, bytes, SectionId::kFrames, coded(bodies, 9));
    ASSERT_TRUE(decoded) << decoded.error().to_string();
    std::vector<float> out(clip.positions.size());
    EXPECT_TRUE((*decoded)->reconstruct(0, {out.data(), clip.frame_count, clip.vertex_count}, kSerial));
}

TEST(RtpcaHostile, MoreComponentsThanTheRankAreRefused) {
    const MeshSequence clip = test::sheet(6, 5, 9);
    const auto bytes = encode(clip, 2, 1e-2);
    RtpcaHeader header =
        *RtpcaHeader::read(parse_clip_bitstream(bytes)->payload(SectionId::kParameters), clip.vertex_count);
    header.component_count = 40;  // all of cluster 1, which has fewer vertices
    std::vector<RtpcaComponent> list(40, {1, 20});
    BitCoder coder;
    ASSERT_TRUE(code_components(coder, list, 2));
    const auto stream = coder.finish();
    ByteWriter basis;
    basis.put_varint(stream.size());
    basis.put_bytes(stream);
    auto sections = sections_of(bytes);
    sections[0].second = header.write();
    sections[static_cast<std::size_t>(SectionId::kBasis) - 1].second = basis.take();
    const auto whole =
        write_clip_bitstream(CodecMethod::kRtpca, clip.vertex_count, clip.frame_count, sections);
    const auto refused = decode_clip(whole, clip.triangles, -1, kLimit, kSerial);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::kCorrupt);
}

}  // namespace
}  // namespace batchenc
