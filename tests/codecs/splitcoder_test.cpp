#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "codecs/clip_bitstream.h"
#include "codecs/clip_codec.h"
#include "codecs/static_coder.h"
#include "kernels/bounding_box.h"
#include "tests/codecs/codec_support.h"
#include "tests/support/sample_clips.h"
#include "tests/support/thread_executor.h"

namespace batchenc {
namespace {

using test::decode, test::kLimit, test::sections_of, test::walker;
const SerialExecutor kSerial;
using enum GeometryPredictor;

CodecParameters with(GeometryPredictor predictor, std::int32_t bits) {
    CodecParameters parameters;
    parameters.method = CodecMethod::kSplitcoder;
    parameters.predictor = predictor;
    parameters.bits = bits;
    return parameters;
}

std::vector<std::uint8_t> encode(const MeshSequence& clip, const CodecParameters& parameters,
                                 const Executor& executor = kSerial) {
    const auto encoded = encode_clip(clip.view(), clip.triangles, {}, parameters, executor);
    EXPECT_TRUE(encoded) << encoded.error().to_string();
    if (!encoded) return {};
    EXPECT_EQ(encoded->section_bytes.total(), static_cast<std::int64_t>(encoded->bitstream.size()));
    return encoded->bitstream;
}

TEST(Splitcoder, KeepsItsBoundOnEveryKindOfClip) {
    for (const auto& [name, clip] : test::every_kind_of_clip()) {
        for (const GeometryPredictor predictor : {kAuto, kFitted}) {
            for (const std::int32_t bits : {4, 9, 14, 20}) {
                const CodecParameters parameters = with(predictor, bits);
                const double bound = bound_of(parameters, bounding_box(clip.view()));
                const MeshSequence decoded = decode(clip, encode(clip, parameters));
                EXPECT_LE(test::largest_distance(clip.view(), decoded.view()), bound)
                    << name << ", " << bits << " bits";
            }
        }
    }
}

TEST(Splitcoder, KeepsTargetsInWorldUnitsAndParts) {
    const MeshSequence clip = test::sheet(12, 10, 17);
    const double diagonal = bounding_box(clip.view()).diagonal();
    for (const double part : {1e-1, 1e-3, 3.7e-5}) {
        CodecParameters parameters = with(kFitted, 12);
        parameters.max_error_relative = part;
        const auto relative = encode(clip, parameters);
        EXPECT_LE(test::largest_distance(clip.view(), decode(clip, relative).view()), part * diagonal);
        parameters.max_error_relative = 0.0;
        parameters.max_error = part * diagonal;
        EXPECT_EQ(encode(clip, parameters), relative) << part;
        parameters.method = CodecMethod::kStatic;
        parameters.predictor = kMultiway;
        EXPECT_LE(test::largest_distance(clip.view(), decode(clip, encode(clip, parameters)).view()),
                  part * diagonal);
    }
}

TEST(Splitcoder, MotionCostsLessThanFramesAlone) {
    const MeshSequence clip = walker(1000, 40);
    CodecParameters parameters = with(kAuto, 12);
    const auto size = encode(clip, parameters).size();
    parameters.method = CodecMethod::kStatic;
    parameters.predictor = kWeighted;
    EXPECT_LT(2 * size, encode(clip, parameters).size());
}

TEST(Splitcoder, GivesTheSameBytesAndFramesForAnyThreads) {
    const MeshSequence clip = walker(9000, 60);  // two runs of places
    const auto bytes = encode(clip, with(kFitted, 12));
    const MeshSequence decoded = decode(clip, bytes);
    const ShuffledExecutor shuffled(5);
    const test::ThreadExecutor threads(4);
    for (const Executor* executor :
         {static_cast<const Executor*>(&shuffled), static_cast<const Executor*>(&threads)}) {
        EXPECT_EQ(encode(clip, with(kFitted, 12), *executor), bytes);
        EXPECT_EQ(decode(clip, bytes, *executor).positions, decoded.positions);
    }
}

TEST(Splitcoder, SaysWhatItWasCodedWith) {
    const MeshSequence clip = test::sheet(6, 5, 4);
    CodecParameters parameters = with(kFitted, 10);
    parameters.max_error = 0.125;
    const auto info = read_clip_info(encode(clip, parameters));
    ASSERT_TRUE(info);
    EXPECT_EQ(info->method, CodecMethod::kSplitcoder);
    EXPECT_EQ(info->parameters.predictor, kFitted);
    EXPECT_EQ(info->parameters.max_error, 0.125);
    EXPECT_EQ(info->frame_count, 4);
    EXPECT_EQ(info->cluster_count, 0);
}

TEST(Splitcoder, RefusesWhatItCannotDo) {
    const MeshSequence clip = test::sheet(6, 5, 4);
    const auto refused = [&](const CodecParameters& parameters) {
        const auto encoded = encode_clip(clip.view(), clip.triangles, {}, parameters, kSerial);
        return encoded ? ErrorCode::kIo : encoded.error().code;
    };
    EXPECT_EQ(refused(with(kHopi, 12)), ErrorCode::kInvalidArgument);
    EXPECT_EQ(refused(with(kFitted, 21)), ErrorCode::kInvalidArgument);
    CodecParameters both = with(kFitted, 12);
    both.max_error = both.max_error_relative = 0.1;
    EXPECT_EQ(refused(both), ErrorCode::kInvalidArgument);
    CodecParameters negative = with(kFitted, 12);
    negative.max_error = -1.0;
    EXPECT_EQ(refused(negative), ErrorCode::kInvalidArgument);
    CodecParameters unbound;
    unbound.max_error = 0.1;
    EXPECT_EQ(refused(unbound), ErrorCode::kUnsupported);
}

bool decodes(std::span<const std::uint8_t> bytes, const MeshSequence& like) {
    return decode_clip(bytes, like.triangles, -1, kLimit, kSerial).has_value();
}

TEST(Splitcoder, RejectsEveryTruncationAndFlippedBitAndExtraByte) {
    const MeshSequence clip = test::sheet(4, 3, 4);
    auto bytes = encode(clip, with(kFitted, 8));
    ASSERT_TRUE(decodes(bytes, clip));
    for (std::size_t size = 0; size < bytes.size(); ++size)
        EXPECT_FALSE(decodes(std::span(bytes).first(size), clip)) << size;
    for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
        bytes[bit / 8] ^= static_cast<std::uint8_t>(1u << (bit % 8));
        EXPECT_FALSE(decodes(bytes, clip)) << "bit " << bit;
        bytes[bit / 8] ^= static_cast<std::uint8_t>(1u << (bit % 8));
    }
    bytes.push_back(0);
    EXPECT_FALSE(decodes(bytes, clip));
}

// Behind valid checksums every byte is still hostile: nothing may be read or written outside.
TEST(Splitcoder, SurvivesChangesBehindValidChecksums) {
    MeshSequence clip = test::sheet(6, 5, 9);
    for (const bool points : {false, true}) {
        if (points) clip.triangles.clear();
        const auto bytes = encode(clip, with(kFitted, 10));
        const auto sections = sections_of(bytes);
        int refused = 0;
        for (std::size_t s = 0; s < sections.size(); ++s) {
            for (std::size_t at = 0; at < sections[s].second.size(); ++at) {
                for (const int change : {0x01, 0x80, 0xff}) {
                    auto changed = sections;
                    changed[s].second[at] ^= static_cast<std::uint8_t>(change);
                    const auto whole = write_clip_bitstream(CodecMethod::kSplitcoder, clip.vertex_count,
                                                            clip.frame_count, changed);
                    refused += decodes(whole, clip) ? 0 : 1;
                }
            }
        }
        EXPECT_GT(refused, 0);
    }
}

TEST(Splitcoder, RefusesCountsAndMemoryBeforeAllocating) {
    const MeshSequence clip = test::sheet(6, 5, 9);
    const auto bytes = encode(clip, with(kFitted, 8));
    const auto sections = sections_of(bytes);
    for (const auto& [vertices, frames] :
         {std::pair<std::int64_t, std::int64_t>{2000000000, 9}, {30, 2000000000}, {20000000, 9}}) {
        const auto huge = write_clip_bitstream(CodecMethod::kSplitcoder, vertices, frames, sections);
        EXPECT_FALSE(decode_clip(huge, clip.triangles, -1, kLimit, kSerial)) << vertices << " x " << frames;
    }
    const auto refused = decode_clip(bytes, clip.triangles, -1, 10000, kSerial);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::kLimit);
}

MeshSequence golden_clip(std::int32_t nx, std::int32_t ny, std::int32_t frames) {
    MeshSequence clip = test::sheet(nx, ny, frames);
    for (std::int32_t f = 0; f < frames; ++f) {
        for (std::int32_t v = 0; v < nx * ny; ++v) {
            const std::int32_t x = v % nx, y = v / nx, bend = f * (14 - f);
            float* p = clip.view().at(f, v);
            p[0] = static_cast<float>(16 * x + (x * y + 3 * f) % 5 + f * y) / 16.0f;
            p[1] = static_cast<float>(16 * y - bend * x / 4) / 16.0f;
            p[2] = static_cast<float>(bend * x * y / 16 + (x * x + y * f) % 7) / 16.0f;
        }
    }
    return clip;
}

#include "golden_split_v1.inc"

// What a second decoder found (tests/app/independent_decoder.py), every bit of it.
void expect_golden(const MeshSequence& clip, std::span<const std::uint8_t> bitstream, std::uint32_t expected,
                   GeometryPredictor predictor = kFitted) {
    const MeshSequence decoded = decode(clip, bitstream);
    EXPECT_EQ(test::checksum_of(decoded), expected);
    const auto info = read_clip_info(bitstream);
    ASSERT_TRUE(info);
    EXPECT_EQ(info->parameters.predictor, predictor);
    EXPECT_LE(test::largest_distance(clip.view(), decoded.view()), info->parameters.max_error);
}

TEST(Splitcoder, DecodesTheGoldenStreamOfVersion1) {
    expect_golden(golden_clip(8, 7, 14), kGoldenSplitMesh, 0x4f4b9a7f);
}

TEST(Splitcoder, DecodesTheGoldenStreamOfPoints) {
    MeshSequence clip = golden_clip(7, 6, 12);
    clip.triangles.clear();
    expect_golden(clip, kGoldenSplitPoints, 0x4fae210a);
}

TEST(Splitcoder, DecodesTheGoldenStreamsAtGates) {
    const MeshSequence clip = golden_clip(8, 7, 14);
    expect_golden(clip, kGoldenSplitTime, 0x5cad6161, kTime);
    expect_golden(clip, kGoldenSplitSpaceTime, 0xc4c8b4b5, kSpaceTimeMultiway);
    expect_golden(clip, kGoldenSplitLocal, 0x11c62cfc, kLocalMultiway);
}

}  // namespace
}  // namespace batchenc
