#include <gtest/gtest.h>

#include <limits>

#include "codecs/clip_bitstream.h"
#include "codecs/clip_codec.h"
#include "kernels/bounding_box.h"
#include "kernels/crc32c.h"
#include "tests/codecs/codec_support.h"
#include "tests/support/sample_clips.h"
#include "tests/support/thread_executor.h"

namespace batchenc {
namespace {

constexpr std::int64_t kLimit = std::int64_t{1} << 30;
const SerialExecutor kSerial;

struct Setting {
    std::int32_t clusters, components;
    int bits;
    CoordinateSpace space;
};

CodecParameters parameters_of(const Setting& setting) {
    CodecParameters parameters;
    parameters.components = setting.components;
    parameters.basis_bits = parameters.coefficient_bits = setting.bits;
    parameters.space = setting.space;
    return parameters;
}

const Setting kSettings[] = {
    {1, 1, 12, CoordinateSpace::kLocal},   {4, 3, 12, CoordinateSpace::kLocal},
    {7, 50, 14, CoordinateSpace::kLocal},  {200, 5, 2, CoordinateSpace::kLocal},
    {3, 4, 20, CoordinateSpace::kLocal},   {1, 6, 12, CoordinateSpace::kWorld},
    {5, 100, 16, CoordinateSpace::kWorld},
};

EncodedClip encode(const MeshSequence& clip, const Setting& setting, const Executor& executor = kSerial) {
    SegmentationParameters segmentation_parameters;
    segmentation_parameters.clusters = setting.clusters;
    const auto segmentation = segment_clip(clip.view(), clip.triangles, segmentation_parameters, executor);
    EXPECT_TRUE(segmentation);
    auto encoded = encode_clip(clip.view(), clip.triangles, *segmentation, parameters_of(setting), executor);
    EXPECT_TRUE(encoded) << encoded.error().to_string();
    return *encoded;
}

MeshSequence decode(const MeshSequence& like, std::span<const std::uint8_t> bitstream,
                    std::int32_t components = -1, const Executor& executor = kSerial) {
    MeshSequence decoded = like;
    std::fill(decoded.positions.begin(), decoded.positions.end(), std::numeric_limits<float>::quiet_NaN());
    const auto clip = decode_clip(bitstream, like.triangles, components, kLimit, executor);
    EXPECT_TRUE(clip) << clip.error().to_string();
    if (clip) {
        EXPECT_TRUE((*clip)->reconstruct(0, decoded.view(), executor));
    }
    return decoded;
}

TEST(Rlpca, RoundTripsEveryKindOfClip) {
    for (const auto& [name, clip] : test::every_kind_of_clip()) {
        const double side = bounding_box(clip.view()).largest_side();
        for (const Setting& setting : kSettings) {
            const EncodedClip encoded = encode(clip, setting);
            EXPECT_EQ(encoded.section_bytes.total(), static_cast<std::int64_t>(encoded.bitstream.size()))
                << name;
            const MeshSequence decoded = decode(clip, encoded.bitstream);
            for (const float value : decoded.positions) ASSERT_TRUE(std::isfinite(value)) << name;
            const double error = test::largest_distance(clip.view(), decoded.view());
            // Every component the clip can have, finely quantised: what is left is rounding, which grows with
            // the distance from the origin.
            if (setting.components >= 50) {
                EXPECT_LE(error, 2e-3 * side + 1e-5) << name << ", clusters " << setting.clusters;
            } else {
                EXPECT_LE(error, 1.5 * side + 1e-5) << name;  // never worse than losing the shape
            }
        }
    }
}

TEST(Rlpca, MoreComponentsNeverHurtMuchAndSoonHelp) {
    const MeshSequence clip = test::sheet(20, 20, 40);
    double last = 1e9;
    for (const std::int32_t components : {1, 2, 4, 8, 16}) {
        const double error = test::largest_distance(
            clip.view(),
            decode(clip, encode(clip, {4, components, 16, CoordinateSpace::kLocal}).bitstream).view());
        EXPECT_LT(error, last);
        last = error;
    }
    EXPECT_LT(last, 1e-3);
}

TEST(Rlpca, SameBytesForAnyExecutor) {
    const MeshSequence clip = test::sheet(40, 30, 25);
    const Setting setting = {9, 8, 12, CoordinateSpace::kLocal};
    const EncodedClip expected = encode(clip, setting);
    const MeshSequence decoded = decode(clip, expected.bitstream);
    for (std::uint64_t seed = 0; seed < 10; ++seed) {
        const ShuffledExecutor shuffled(seed);
        ASSERT_EQ(encode(clip, setting, shuffled).bitstream, expected.bitstream) << "seed " << seed;
        ASSERT_EQ(decode(clip, expected.bitstream, -1, shuffled).positions, decoded.positions)
            << "seed " << seed;
    }
}

TEST(Rlpca, SameBytesOnSeveralThreads) {
    const MeshSequence clip = test::sheet(60, 40, 30);
    const Setting setting = {12, 20, 12, CoordinateSpace::kLocal};
    const EncodedClip expected = encode(clip, setting);
    const MeshSequence decoded = decode(clip, expected.bitstream);
    for (const int threads : {2, 4}) {
        const test::ThreadExecutor executor(threads);
        EXPECT_EQ(encode(clip, setting, executor).bitstream, expected.bitstream);
        EXPECT_EQ(decode(clip, expected.bitstream, -1, executor).positions, decoded.positions);
    }
}

// Sizes that float32 holds, but not their squares or sums: refused, never written as if it were well.
TEST(Rlpca, RefusesWhatFloat32CannotCarry) {
    for (const double size : {1e-44, 1e-30, 1e-12, 1e12, 1e18, 1e30, 1e37, 1.6e38}) {
        const MeshSequence clip = test::sheet(8, 8, 12, [size](const std::array<double, 3>& p, double time) {
            const auto q = test::bend(p, time);
            return std::array<double, 3>{0.2 * size * q[0], 0.2 * size * q[1], 0.2 * size * q[2]};
        });
        for (const auto space : {CoordinateSpace::kLocal, CoordinateSpace::kWorld}) {
            SegmentationParameters one;
            one.clusters = 1;
            const auto segmentation = segment_clip(clip.view(), clip.triangles, one, kSerial);
            ASSERT_TRUE(segmentation);
            const auto encoded = encode_clip(clip.view(), clip.triangles, *segmentation,
                                             parameters_of({1, 12, 14, space}), kSerial);
            if (!encoded) {
                EXPECT_EQ(encoded.error().code, ErrorCode::kLimit)
                    << size << ": " << encoded.error().to_string();
                EXPECT_TRUE(size < 1e-20 || size > 1e20) << size;
                continue;
            }
            const double error = test::largest_distance(clip.view(), decode(clip, encoded->bitstream).view());
            EXPECT_LE(error, 0.02 * bounding_box(clip.view()).largest_side()) << size;
        }
    }
}

TEST(Rlpca, ReencodesToSameBytes) {
    const MeshSequence clip = test::sheet(10, 10, 10);
    EXPECT_EQ(encode(clip, kSettings[1]).bitstream, encode(clip, kSettings[1]).bitstream);
}

TEST(Rlpca, DecodesAnyRangeOfFrames) {
    const MeshSequence clip = test::sheet(9, 8, 37);
    for (const auto space : {CoordinateSpace::kLocal, CoordinateSpace::kWorld}) {
        const EncodedClip encoded = encode(clip, {3, 5, 12, space});
        test::expect_any_range_decodes(encoded.bitstream, clip);
    }
}

TEST(Rlpca, DecodesTheFirstComponents) {
    const MeshSequence clip = test::sheet(16, 16, 40);
    const EncodedClip encoded = encode(clip, {4, 12, 14, CoordinateSpace::kLocal});
    double last = 1e9;
    for (const std::int32_t components : {1, 2, 4, 8, 12}) {
        const double error =
            test::largest_distance(clip.view(), decode(clip, encoded.bitstream, components).view());
        EXPECT_LT(error, last) << components;
        last = error;
    }
    EXPECT_EQ(decode(clip, encoded.bitstream, 12).positions, decode(clip, encoded.bitstream).positions);
    EXPECT_EQ(decode(clip, encoded.bitstream, 9999).positions, decode(clip, encoded.bitstream).positions);
    EXPECT_TRUE(std::isfinite(decode(clip, encoded.bitstream, 0).positions[0]));
}

TEST(Rlpca, InfoTellsTheParameters) {
    const MeshSequence clip = test::sheet(6, 6, 9);
    const EncodedClip encoded = encode(clip, {3, 5, 11, CoordinateSpace::kWorld});
    const auto info = read_clip_info(encoded.bitstream);
    ASSERT_TRUE(info);
    EXPECT_EQ(info->vertex_count, 36);
    EXPECT_EQ(info->frame_count, 9);
    EXPECT_EQ(info->cluster_count, 3);
    EXPECT_EQ(info->parameters.components, 5);
    EXPECT_EQ(info->parameters.basis_bits, 11);
    EXPECT_EQ(info->parameters.space, CoordinateSpace::kWorld);
    EXPECT_EQ(info->section_bytes.frames, 0) << "no LCF in world space";
}

TEST(Rlpca, RejectsNaNWithItsPlace) {
    MeshSequence clip = test::sheet(5, 5, 6);
    const auto segmentation = segment_clip(clip.view(), clip.triangles, {}, kSerial);
    clip.positions[static_cast<std::size_t>((4 * 25 + 7) * 3 + 1)] = std::numeric_limits<float>::quiet_NaN();
    const auto encoded = encode_clip(clip.view(), clip.triangles, *segmentation, {}, kSerial);
    ASSERT_FALSE(encoded);
    EXPECT_EQ(encoded.error().code, ErrorCode::kNotFinite);
    EXPECT_NE(encoded.error().message.find("frame 4, vertex 7"), std::string::npos)
        << encoded.error().message;
}

TEST(Rlpca, RejectsParametersOutsideTheirRange) {
    const MeshSequence clip = test::sheet(5, 5, 6);
    const auto segmentation = segment_clip(clip.view(), clip.triangles, {}, kSerial);
    CodecParameters parameters;
    parameters.basis_bits = 1;
    const auto encoded = encode_clip(clip.view(), clip.triangles, *segmentation, parameters, kSerial);
    ASSERT_FALSE(encoded);
    EXPECT_EQ(encoded.error().code, ErrorCode::kInvalidArgument);
}

// ---- hostile bytes ----

bool decodes(std::span<const std::uint8_t> bytes, const MeshSequence& like) {
    return decode_clip(bytes, like.triangles, -1, kLimit, kSerial).has_value();
}

TEST(Rlpca, RejectsEveryTruncation) {
    const MeshSequence clip = test::sheet(5, 4, 6);
    const auto bytes = encode(clip, {3, 3, 8, CoordinateSpace::kLocal}).bitstream;
    ASSERT_TRUE(decodes(bytes, clip));
    for (std::size_t size = 0; size < bytes.size(); ++size) {
        const std::vector<std::uint8_t> shorter(
            bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size));  // fresh and exact
        EXPECT_FALSE(decodes(shorter, clip)) << size;
    }
}

TEST(Rlpca, RejectsEveryFlippedBit) {
    const MeshSequence clip = test::sheet(5, 4, 6);
    auto bytes = encode(clip, {3, 3, 8, CoordinateSpace::kLocal}).bitstream;
    for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
        bytes[bit / 8] ^= static_cast<std::uint8_t>(1u << (bit % 8));
        EXPECT_FALSE(decodes(bytes, clip)) << "bit " << bit;
        bytes[bit / 8] ^= static_cast<std::uint8_t>(1u << (bit % 8));
    }
}

TEST(Rlpca, RejectsExtraBytes) {
    const MeshSequence clip = test::sheet(5, 4, 6);
    auto bytes = encode(clip, kSettings[1]).bitstream;
    bytes.push_back(0);
    EXPECT_FALSE(decodes(bytes, clip));
}

TEST(Rlpca, RejectsBadMagicAndFutureVersionAndUnknownCoder) {
    const MeshSequence clip = test::sheet(5, 4, 6);
    const auto code_after = [&](std::size_t at, std::uint8_t value) {
        auto bytes = encode(clip, kSettings[1]).bitstream;
        bytes[at] = value;
        return decode_clip(bytes, clip.triangles, -1, kLimit, kSerial).error().code;
    };
    EXPECT_EQ(code_after(0, 'X'), ErrorCode::kFormat);
    EXPECT_EQ(code_after(4, 2), ErrorCode::kUnsupported);
    EXPECT_EQ(code_after(5, 200), ErrorCode::kUnsupported);
}

/// Rebuilds a bitstream with one section's payload changed and every checksum right: what a checksum cannot
/// catch.
std::vector<std::uint8_t> with_changed_payload(std::span<const std::uint8_t> bytes, std::size_t section,
                                               std::size_t at, std::uint8_t change) {
    const auto clip = *parse_clip_bitstream(bytes);
    std::vector<SectionPayload> sections;
    for (std::size_t i = 0; i < kSectionCount - 1; ++i) {
        const auto payload = clip.payloads[i];
        sections.emplace_back(static_cast<SectionId>(i + 1),
                              std::vector<std::uint8_t>(payload.begin(), payload.end()));
    }
    sections[section].second[at] ^= change;
    return write_clip_bitstream(clip.method, clip.vertex_count, clip.frame_count, sections);
}

// Behind valid checksums every byte is still hostile: nothing may be read or written outside, and whatever
// decodes is finite or refused.
TEST(Rlpca, SurvivesChangesBehindValidChecksums) {
    const MeshSequence clip = test::sheet(6, 5, 9);
    for (const auto space : {CoordinateSpace::kLocal, CoordinateSpace::kWorld}) {
        const auto bytes = encode(clip, {3, 3, 8, space}).bitstream;
        const auto parsed = *parse_clip_bitstream(bytes);
        int refused = 0, accepted = 0;
        for (std::size_t section = 0; section + 1 < kSectionCount; ++section) {
            for (std::size_t at = 0; at < parsed.payloads[section].size(); ++at) {
                for (const std::uint8_t change :
                     {std::uint8_t{0x01}, std::uint8_t{0x80}, std::uint8_t{0xff}}) {
                    const auto changed = with_changed_payload(bytes, section, at, change);
                    const auto decoded = decode_clip(changed, clip.triangles, -1, kLimit, kSerial);
                    if (!decoded) {
                        ++refused;
                        continue;
                    }
                    ++accepted;  // a changed quantiser or corner of the bounding box is another valid clip
                    std::vector<float> out(clip.positions.size());
                    EXPECT_TRUE((*decoded)->reconstruct(0, {out.data(), clip.frame_count, clip.vertex_count},
                                                        kSerial));
                }
            }
        }
        EXPECT_GT(refused, accepted);
    }
}

TEST(Rlpca, RefusesCountsThatTheBytesCannotHold) {
    const MeshSequence clip = test::sheet(6, 5, 9);
    const auto bytes = encode(clip, {3, 3, 8, CoordinateSpace::kLocal}).bitstream;
    const auto parsed = *parse_clip_bitstream(bytes);
    std::vector<SectionPayload> sections;
    for (std::size_t i = 0; i + 1 < kSectionCount; ++i) {
        sections.emplace_back(
            static_cast<SectionId>(i + 1),
            std::vector<std::uint8_t>(parsed.payloads[i].begin(), parsed.payloads[i].end()));
    }
    for (const auto& [vertices, frames] :
         {std::pair<std::int64_t, std::int64_t>{2000000000, 9}, {30, 2000000000}, {20000000, 9}}) {
        const auto huge = write_clip_bitstream(CodecMethod::kRlpca, vertices, frames, sections);
        EXPECT_FALSE(decode_clip(huge, clip.triangles, -1, kLimit, kSerial)) << vertices << " x " << frames;
    }
}

TEST(Rlpca, RefusesMoreMemoryThanAllowed) {
    const MeshSequence clip = test::sheet(30, 30, 9);
    const auto bytes = encode(clip, {3, 5, 8, CoordinateSpace::kLocal}).bitstream;
    for (const std::int64_t limit : {0, 1000, 60000, 80000}) {
        const auto refused = decode_clip(bytes, clip.triangles, -1, limit, kSerial);
        ASSERT_FALSE(refused) << limit;
        EXPECT_EQ(refused.error().code, ErrorCode::kLimit) << limit;
    }
    // Few vertices, but frames without end: cheap to code, and refused before anything is made for them.
    const MeshSequence still =
        test::sheet(3, 2, 5000, [](const std::array<double, 3>& p, double) { return p; });
    const auto long_one = encode(still, {2, 1, 8, CoordinateSpace::kLocal}).bitstream;
    EXPECT_LT(long_one.size(), 2000u);
    const auto refused = decode_clip(long_one, still.triangles, -1, 500000, kSerial);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::kLimit);
}

TEST(Rlpca, RefusesConnectivityOfAnotherMesh) {
    const MeshSequence clip = test::sheet(6, 5, 9);
    const auto bytes = encode(clip, kSettings[1]).bitstream;
    const std::vector<Triangle> other = {{0, 1, 500}};
    EXPECT_FALSE(decode_clip(bytes, other, -1, kLimit, kSerial));
}

// The stream of version 1 as it was first written must decode for ever; a change of format adds a file beside
// it.
#include "golden_rlpca_v1.inc"

TEST(Rlpca, DecodesTheGoldenStreamOfVersion1) {
    const MeshSequence clip = test::golden_sheet();
    ASSERT_GT(kGoldenRlpcaV1.size(), 0u);
    EXPECT_LT(test::largest_distance(clip.view(), decode(clip, kGoldenRlpcaV1).view()), 1e-3);
}

TEST(ClipBitstream, AcceptsWhatItWrites) {
    const std::vector<SectionPayload> sections = {{SectionId::kParameters, {1, 2, 3}},
                                                  {SectionId::kResiduals, {}}};
    const auto bytes = write_clip_bitstream(CodecMethod::kPdct, 5, 6, sections);
    const auto clip = parse_clip_bitstream(bytes);
    ASSERT_TRUE(clip);
    EXPECT_EQ(clip->method, CodecMethod::kPdct);
    EXPECT_EQ(clip->vertex_count, 5);
    EXPECT_EQ(clip->frame_count, 6);
    EXPECT_EQ(clip->payload(SectionId::kParameters).size(), 3u);
    EXPECT_FALSE(read_clip_info(bytes)) << "a method that this version does not have";
}

TEST(ClipBitstream, RejectsSectionsOutOfOrder) {
    const std::vector<SectionPayload> sections = {{SectionId::kBasis, {1}}, {SectionId::kFrames, {1}}};
    EXPECT_FALSE(parse_clip_bitstream(write_clip_bitstream(CodecMethod::kRlpca, 5, 6, sections)));
    EXPECT_FALSE(parse_clip_bitstream(write_clip_bitstream(CodecMethod::kRlpca, 0, 6, {})));
}

}  // namespace
}  // namespace batchenc
