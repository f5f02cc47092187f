#include "codecs/static_coder.h"

#include <gtest/gtest.h>

#include <limits>
#include <optional>

#include "kernels/bounding_box.h"
#include "kernels/byte_stream.h"
#include "tests/support/sample_clips.h"
#include "tests/support/thread_executor.h"

namespace batchenc {
namespace {

constexpr std::int64_t kLimit = std::int64_t{1} << 30;
const SerialExecutor kSerial;

using enum GeometryPredictor;
constexpr GeometryPredictor kPredictors[] = {
    kParallelogram, kMultiway, kLocalParallelogram, kLocalMultiway, kFitted, kToumaGotsman, kHope,
    kHopi,          kHops,     kWeighted,           kAuto};
constexpr GeometryPredictor kBending[] = {kToumaGotsman, kHope, kHopi, kHops};
constexpr TangentialPredictor kTangentials[] = {TangentialPredictor::kParallelogram,
                                                TangentialPredictor::kMultiway, TangentialPredictor::kFitted,
                                                TangentialPredictor::kWeighted};

CodecParameters parameters_of(std::int32_t bits, GeometryPredictor predictor = kAuto) {
    CodecParameters parameters;
    parameters.method = CodecMethod::kStatic;
    parameters.bits = bits;
    parameters.predictor = predictor;
    return parameters;
}

EncodedClip encode(const MeshSequence& clip, const CodecParameters& parameters,
                   const Executor& executor = kSerial) {
    auto encoded = encode_clip(clip.view(), clip.triangles, {}, parameters, executor);
    EXPECT_TRUE(encoded) << encoded.error().to_string();
    return std::move(*encoded);
}
EncodedClip encode(const MeshSequence& clip, std::int32_t bits, GeometryPredictor predictor = kAuto,
                   const Executor& executor = kSerial) {
    return encode(clip, parameters_of(bits, predictor), executor);
}

/// Decodes every frame; an error where the clip or a frame is refused.
Expected<MeshSequence> try_decode(const MeshSequence& like, std::span<const std::uint8_t> bitstream,
                                  const Executor& executor = kSerial) {
    MeshSequence decoded = like;
    std::fill(decoded.positions.begin(), decoded.positions.end(), std::numeric_limits<float>::quiet_NaN());
    const auto clip = decode_clip(bitstream, like.triangles, -1, kLimit, executor);
    if (!clip) return tl::unexpected(clip.error());
    if (auto done = (*clip)->reconstruct(0, decoded.view(), executor); !done)
        return tl::unexpected(done.error());
    return decoded;
}

MeshSequence decode(const MeshSequence& like, std::span<const std::uint8_t> bitstream,
                    const Executor& executor = kSerial) {
    auto decoded = try_decode(like, bitstream, executor);
    EXPECT_TRUE(decoded) << decoded.error().to_string();
    return decoded ? std::move(*decoded) : like;
}

TEST(Static, RoundTripsEveryKindOfClipAndMeetsItsBound) {
    for (const auto& [name, clip] : test::every_kind_of_clip()) {
        const double e_max =
            static_cast<double>(static_cast<float>(bounding_box(clip.view()).largest_side()));
        for (const GeometryPredictor predictor : kPredictors) {
            for (const std::int32_t bits : {4, 5, 8, 12, 16, 20, 24}) {
                if (predictor == kAuto && bits % 8 != 4) continue;  // all of the others once more
                const EncodedClip encoded = encode(clip, bits, predictor);
                EXPECT_EQ(encoded.section_bytes.total(), static_cast<std::int64_t>(encoded.bitstream.size()));
                EXPECT_GT(encoded.section_bytes.residuals, 0);
                const MeshSequence decoded = decode(clip, encoded.bitstream);
                EXPECT_LE(test::largest_distance(clip.view(), decoded.view()), e_max * std::ldexp(1.0, -bits))
                    << name << ", " << to_name(predictor) << ", " << bits << " bits";
            }
        }
    }
}

/// Tangential predictions, and what a surface is fitted to: the least, the most, and little of it.
TEST(Static, RoundTripsEveryKindOfClipInEveryForm) {
    for (const auto& [name, clip] : test::every_kind_of_clip()) {
        const double e_max =
            static_cast<double>(static_cast<float>(bounding_box(clip.view()).largest_side()));
        for (const GeometryPredictor predictor : kBending) {
            for (const TangentialPredictor tangential : kTangentials) {
                for (const NormalFit& fit :
                     {NormalFit{3, 0.0, 0.0}, NormalFit{64, 8.0, 0.0}, NormalFit{5, 2.0, 1.0}, NormalFit{}}) {
                    for (const std::int32_t bits : {6, 24}) {
                        CodecParameters parameters = parameters_of(bits, predictor);
                        parameters.tangential = tangential;
                        parameters.fit = fit;
                        const MeshSequence decoded = decode(clip, encode(clip, parameters).bitstream);
                        EXPECT_LE(test::largest_distance(clip.view(), decoded.view()),
                                  e_max * std::ldexp(1.0, -bits))
                            << name << ", " << to_name(predictor) << ", " << to_name(tangential) << ", "
                            << fit.vertices << " vertices, " << bits << " bits";
                    }
                }
            }
        }
    }
}

/// Beside a triangle of one step a fit learns from a vertex at the box's far end, and then predicts one that
/// no int32 can hold the residual of.
TEST(Static, PredictsFarOutsideWithoutHarm) {
    MeshSequence clip =
        test::animate({{0, 0, 0}, {1e-6, 0, 0}, {0, 1e-6, 0}, {1, 1, 1}, {1, 0, 0}, {0, 0, 1}},
                      {{0, 1, 2}, {1, 3, 2}, {2, 3, 4}, {4, 3, 5}}, 1,
                      [](const std::array<double, 3>& p, double) { return p; });
    for (const GeometryPredictor predictor : kPredictors) {
        for (const TangentialPredictor tangential : kTangentials) {
            CodecParameters parameters = parameters_of(24, predictor);
            parameters.tangential = tangential;
            const MeshSequence decoded = decode(clip, encode(clip, parameters).bitstream);
            EXPECT_LE(test::largest_distance(clip.view(), decoded.view()), std::ldexp(1.0, -24))
                << to_name(predictor) << ", " << to_name(tangential);
        }
    }
}

/// Triangles without a normal between others, so that there are no local axes.
TEST(Static, RoundTripsWhereTrianglesCollapse) {
    MeshSequence clip = test::sheet(12, 10, 1);
    for (std::size_t v = 0; v < 120; v += 3) {
        for (std::size_t c = 0; c < 3; ++c) clip.positions[3 * v + c] = clip.positions[c];
    }
    for (const GeometryPredictor predictor : kPredictors) {
        const MeshSequence decoded = decode(clip, encode(clip, 12, predictor).bitstream);
        EXPECT_LE(test::largest_distance(clip.view(), decoded.view()),
                  bounding_box(clip.view()).largest_side() * std::ldexp(1.0, -12))
            << to_name(predictor);
    }
}

TEST(Static, CodesExactlyWhatFloat32CannotBring) {
    // Far from the origin the steps of e_max / 2^24 are finer than those of float32, which leads beyond the
    // bound where nothing is done about it.
    const MeshSequence clip = test::sheet(8, 8, 3, [](const std::array<double, 3>& p, double time) {
        return std::array<double, 3>{20000.0 + p[0], p[1] + time, p[2]};
    });
    const MeshSequence decoded_far = decode(clip, encode(clip, 24).bitstream);
    for (std::size_t k = 0; k < clip.positions.size(); k += 3)
        EXPECT_EQ(decoded_far.positions[k], clip.positions[k]) << "x has steps of 0.002 there";
    EXPECT_LE(test::largest_distance(clip.view(), decoded_far.view()),
              bounding_box(clip.view()).largest_side() * std::ldexp(1.0, -24));
    for (const double size : {1e-44, 1e-38, 1e-20, 1e20, 1e37}) {
        const MeshSequence scaled = test::sheet(6, 6, 2, [size](const std::array<double, 3>& p, double) {
            return std::array<double, 3>{size * p[0], size * p[1], size * p[2]};
        });
        const double e_max = bounding_box(scaled.view()).largest_side();
        for (const std::int32_t bits : {6, 12}) {
            const MeshSequence decoded = decode(scaled, encode(scaled, bits).bitstream);
            EXPECT_LE(test::largest_distance(scaled.view(), decoded.view()), e_max * std::ldexp(1.0, -bits))
                << size;
        }
    }
}

TEST(Static, AutoIsTheSmallest) {
    const MeshSequence clip = test::sheet(25, 20, 4);
    std::size_t smallest = std::numeric_limits<std::size_t>::max();
    for (const GeometryPredictor predictor : kPredictors) {
        const std::size_t size = encode(clip, 12, predictor).bitstream.size();
        if (predictor == kAuto) {
            EXPECT_LE(size, smallest);
        }
        smallest = std::min(smallest, size);
    }
}

// A smooth surface; two-sided, so that a gain tightens the bound. Bits of geometry a vertex.
TEST(Static, RateOnASmoothSurface) {
    const MeshSequence clip = test::sheet(60, 60, 1);
    const auto bits = [&](GeometryPredictor predictor) {
        return 8.0 * static_cast<double>(encode(clip, 12, predictor).bitstream.size()) / 3600.0;
    };
    EXPECT_LT(bits(kMultiway), bits(kParallelogram));
    EXPECT_LT(bits(kLocalMultiway), bits(kLocalParallelogram));
    EXPECT_LT(bits(kAuto), 5.3);
    EXPECT_GT(bits(kAuto), 5.1);
}

TEST(Static, SameBytesForAnyExecutorAndThreads) {
    const MeshSequence clip = test::sheet(20, 15, 70);  // more frames than are coded in one go
    const EncodedClip expected = encode(clip, 12);
    const MeshSequence decoded = decode(clip, expected.bitstream);
    for (std::uint64_t seed = 0; seed < 3; ++seed) {
        const ShuffledExecutor shuffled(seed);
        ASSERT_EQ(encode(clip, 12, kAuto, shuffled).bitstream, expected.bitstream);
        ASSERT_EQ(decode(clip, expected.bitstream, shuffled).positions, decoded.positions);
    }
    const test::ThreadExecutor threads(4);
    EXPECT_EQ(encode(clip, 12, kAuto, threads).bitstream, expected.bitstream);
    EXPECT_EQ(decode(clip, expected.bitstream, threads).positions, decoded.positions);
}

TEST(Static, DecodesAnyRangeOfFrames) {
    const MeshSequence clip = test::sheet(9, 8, 17);
    const EncodedClip encoded = encode(clip, 10);
    const MeshSequence whole = decode(clip, encoded.bitstream);
    const auto decoded = decode_clip(encoded.bitstream, clip.triangles, -1, kLimit, kSerial);
    ASSERT_TRUE(decoded);
    EXPECT_TRUE((*decoded)->labels().empty());
    for (const auto& [begin, end] :
         {std::pair<std::int64_t, std::int64_t>{0, 1}, {5, 11}, {16, 17}, {7, 7}}) {
        std::vector<float> part(static_cast<std::size_t>((end - begin) * clip.vertex_count * 3));
        ASSERT_TRUE((*decoded)->reconstruct(begin, {part.data(), end - begin, clip.vertex_count}, kSerial));
        EXPECT_TRUE(
            std::equal(part.begin(), part.end(), whole.positions.begin() + begin * clip.vertex_count * 3));
    }
    std::vector<float> part(static_cast<std::size_t>(3 * clip.vertex_count * 2));
    EXPECT_EQ((*decoded)->reconstruct(16, {part.data(), 2, clip.vertex_count}, kSerial).error().code,
              ErrorCode::kOutOfRange);
    EXPECT_FALSE((*decoded)->reconstruct(-1, {part.data(), 1, clip.vertex_count}, kSerial));
    EXPECT_FALSE((*decoded)->reconstruct(0, {part.data(), 1, clip.vertex_count - 1}, kSerial));
}

TEST(Static, InfoTellsTheParameters) {
    const MeshSequence clip = test::sheet(6, 6, 9);
    const auto info = read_clip_info(encode(clip, 11).bitstream);
    ASSERT_TRUE(info);
    EXPECT_EQ(info->method, CodecMethod::kStatic);
    EXPECT_EQ(info->vertex_count, 36);
    EXPECT_EQ(info->frame_count, 9);
    EXPECT_EQ(info->cluster_count, 0);
    EXPECT_EQ(info->parameters.bits, 11);
}

TEST(Static, RejectsNaNAndParametersOutsideTheirRange) {
    MeshSequence clip = test::sheet(5, 5, 6);
    for (const std::int32_t bits : {3, 25})
        EXPECT_EQ(encode_clip(clip.view(), clip.triangles, {}, parameters_of(bits), kSerial).error().code,
                  ErrorCode::kInvalidArgument);
    const auto later = parameters_of(12, static_cast<GeometryPredictor>(77));
    EXPECT_EQ(encode_clip(clip.view(), clip.triangles, {}, later, kSerial).error().code,
              ErrorCode::kUnsupported);
    clip.positions[100] = std::numeric_limits<float>::infinity();
    EXPECT_EQ(encode_clip(clip.view(), clip.triangles, {}, parameters_of(12), kSerial).error().code,
              ErrorCode::kNotFinite);
}

// ---- hostile bytes ----

TEST(Static, RejectsEveryTruncationFlippedBitAndExtraByte) {
    const MeshSequence clip = test::sheet(5, 4, 3);
    auto bytes = encode(clip, 8).bitstream;
    ASSERT_TRUE(try_decode(clip, bytes));
    for (std::size_t size = 0; size < bytes.size(); ++size) {
        const std::vector<std::uint8_t> shorter(bytes.begin(),
                                                bytes.begin() + static_cast<std::ptrdiff_t>(size));
        EXPECT_FALSE(try_decode(clip, shorter)) << size;
    }
    for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
        bytes[bit / 8] ^= static_cast<std::uint8_t>(1u << (bit % 8));
        EXPECT_FALSE(try_decode(clip, bytes)) << "bit " << bit;
        bytes[bit / 8] ^= static_cast<std::uint8_t>(1u << (bit % 8));
    }
    bytes.push_back(0);
    EXPECT_FALSE(try_decode(clip, bytes));
}

/// A bitstream with other payloads and every checksum right: what a checksum of bytes cannot catch.
std::vector<std::uint8_t> rebuild(const ClipBitstream& clip, std::span<const std::uint8_t> parameters,
                                  std::span<const std::uint8_t> residuals, std::int64_t vertex_count,
                                  std::int64_t frame_count) {
    const std::vector<SectionPayload> sections = {
        {SectionId::kParameters, {parameters.begin(), parameters.end()}},
        {SectionId::kResiduals, {residuals.begin(), residuals.end()}}};
    return write_clip_bitstream(clip.method, vertex_count, frame_count, sections);
}

TEST(Static, SurvivesChangesBehindValidChecksums) {
    MeshSequence clip = test::sheet(6, 5, 3);
    clip.triangles.resize(clip.triangles.size() - 6);  // some vertices without a triangle
    for (const auto& [bits, predictor] : {std::pair{8, kFitted},
                                          {24, kFitted},
                                          {8, kHope},
                                          {24, kHopi},
                                          {12, kHops},
                                          {24, kToumaGotsman},
                                          {12, kWeighted}}) {
        const auto bytes = encode(clip, bits, predictor).bitstream;
        const auto parsed = *parse_clip_bitstream(bytes);
        int refused = 0, accepted = 0;
        for (const SectionId section : {SectionId::kParameters, SectionId::kResiduals}) {
            const auto payload = parsed.payload(section);
            for (std::size_t at = 0; at < payload.size(); ++at) {
                for (const std::uint8_t change :
                     {std::uint8_t{0x01}, std::uint8_t{0x80}, std::uint8_t{0xff}}) {
                    std::vector<std::uint8_t> changed(payload.begin(), payload.end());
                    changed[at] ^= change;
                    const bool first = section == SectionId::kParameters;
                    const auto decoded = try_decode(
                        clip, rebuild(parsed, first ? changed : parsed.payload(SectionId::kParameters),
                                      first ? parsed.payload(SectionId::kResiduals) : changed,
                                      clip.vertex_count, clip.frame_count));
                    ++(decoded ? accepted : refused);
                    if (!decoded) {
                        EXPECT_EQ(decoded.error().code, ErrorCode::kCorrupt);
                    }
                }
            }
        }
        // The state's checksum sees every change of a residual; another box is another valid clip.
        // Nor does what a surface is fitted to change every prediction.
        const int fit_changes =
            predictor == kHope || predictor == kHopi || predictor == kHops ? 3 * 9 * 3 : 0;
        EXPECT_LE(accepted, 3 * 16 + fit_changes) << to_name(predictor) << ", " << bits;
        EXPECT_GT(refused, accepted) << to_name(predictor) << ", " << bits;
    }
}

/// Of a clip of one frame: its stream behind another header, everything else as it was.
std::vector<std::uint8_t> with_stream(const ClipBitstream& clip, std::span<const std::uint8_t> stream) {
    ByteWriter residuals;
    residuals.put_varint(stream.size());
    residuals.put_bytes(stream);
    return rebuild(clip, clip.payload(SectionId::kParameters), residuals.bytes(), clip.vertex_count, 1);
}

std::vector<std::uint8_t> stream_of(const ClipBitstream& clip) {
    ByteReader reader(clip.payload(SectionId::kResiduals));
    const auto size = reader.get_varint(1 << 20);
    const auto stream = reader.get_bytes(*size);
    EXPECT_EQ(reader.remaining(), 0u);
    return {stream->begin(), stream->end()};
}

/// `stream` with the bytes of a value at a place of it.
template <typename T>
std::vector<std::uint8_t> with_value(std::vector<std::uint8_t> stream, std::size_t at, T value) {
    ByteWriter bytes;
    bytes.put(value);
    std::copy(bytes.bytes().begin(), bytes.bytes().end(), stream.begin() + static_cast<std::ptrdiff_t>(at));
    return stream;
}

TEST(Static, RefusesHostileForms) {
    const MeshSequence clip = test::sheet(6, 5, 1);
    const auto error_of = [&](const ClipBitstream& parsed, std::span<const std::uint8_t> stream) {
        const auto decoded = try_decode(clip, with_stream(parsed, stream));
        return decoded ? std::optional<ErrorCode>() : decoded.error().code;
    };
    constexpr ErrorCode corrupt = ErrorCode::kCorrupt;
    for (const GeometryPredictor predictor : kPredictors) {
        if (predictor == kAuto) continue;
        const auto bytes = encode(clip, 10, predictor).bitstream;
        const auto parsed = *parse_clip_bitstream(bytes);
        const auto stream = stream_of(parsed);
        ASSERT_EQ(error_of(parsed, stream), std::nullopt);
        const bool bends =
            std::find(std::begin(kBending), std::end(kBending), predictor) != std::end(kBending);
        for (const int number : {0, 11, 12, 255})
            EXPECT_EQ(error_of(parsed, with_value(stream, 0, static_cast<std::uint8_t>(number))), corrupt);
        for (std::uint8_t variant = bends ? 4 : 17; variant != 0; ++variant)
            EXPECT_EQ(error_of(parsed, with_value(stream, 1, variant)), corrupt) << int{variant};
        for (std::size_t size = 0; size < stream.size(); ++size)
            EXPECT_EQ(error_of(parsed, std::span(stream).first(size)), corrupt) << size;
        if (!bends || predictor == kToumaGotsman) continue;
        for (const int vertices : {0, 1, 2, 65, 128, 255})
            EXPECT_EQ(error_of(parsed, with_value(stream, 2, static_cast<std::uint8_t>(vertices))), corrupt)
                << vertices;
        constexpr float kInfinity = std::numeric_limits<float>::infinity();
        for (const float exponent :
             {std::numeric_limits<float>::quiet_NaN(), kInfinity, -kInfinity, -1.0f, -1e-30f, 8.000001f})
            EXPECT_EQ(error_of(parsed, with_value(stream, 3, exponent)), corrupt) << exponent;
        for (const float cosine :
             {std::numeric_limits<float>::quiet_NaN(), kInfinity, -kInfinity, -1.0f, -1e-30f, 1.0000001f})
            EXPECT_EQ(error_of(parsed, with_value(stream, 7, cosine)), corrupt) << cosine;
    }
}

TEST(Static, RefusesCountsThatTheBytesCannotHold) {
    const MeshSequence clip = test::sheet(6, 5, 3);
    const auto bytes = encode(clip, 8).bitstream;
    const auto parsed = *parse_clip_bitstream(bytes);
    for (const auto& [vertices, frames] : {std::pair<std::int64_t, std::int64_t>{2000000000, 3},
                                           {30, 2000000000},
                                           {20000000, 3},
                                           {31, 3},
                                           {30, 2}}) {
        const auto huge = rebuild(parsed, parsed.payload(SectionId::kParameters),
                                  parsed.payload(SectionId::kResiduals), vertices, frames);
        MeshSequence like = clip;
        if (vertices == 31) like.vertex_count = 31;
        like.frame_count = std::min<std::int64_t>(frames, 3);
        like.positions.resize(static_cast<std::size_t>(3 * like.vertex_count * like.frame_count));
        EXPECT_FALSE(try_decode(like, huge)) << vertices << " x " << frames;
    }
    EXPECT_EQ(decode_clip(bytes, clip.triangles, -1, 1000, kSerial).error().code, ErrorCode::kLimit);
    const std::vector<Triangle> other = {{0, 1, 500}};
    EXPECT_FALSE(decode_clip(bytes, other, -1, kLimit, kSerial));
}

// The stream of version 1 as it was first written must decode for ever, to these bits.
MeshSequence golden_clip() {
    MeshSequence clip = test::sheet(5, 4, 2, [](const std::array<double, 3>& p, double time) {
        return std::array<double, 3>{p[0] + time * p[1], p[1] - 0.25 * time * time, 0.5 * p[0] * p[1] + p[0]};
    });
    clip.triangles.resize(18);
    return clip;
}

#include "golden_static_v1.inc"

TEST(Static, DecodesTheGoldenStreamOfVersion1) {
    const MeshSequence clip = golden_clip();
    const MeshSequence decoded = decode(clip, kGoldenStaticV1);
    ASSERT_EQ(decoded.positions.size(), kGoldenStaticPositionsV1.size());
    for (std::size_t k = 0; k < decoded.positions.size(); ++k)
        EXPECT_EQ(std::bit_cast<std::uint32_t>(decoded.positions[k]), kGoldenStaticPositionsV1[k]) << k;
}

// Likewise the first stream with a bending angle.
MeshSequence bending_clip() {
    MeshSequence clip = test::sheet(7, 6, 1);
    std::swap(clip.triangles[20][1], clip.triangles[20][2]);  // wound the other way
    return clip;
}

#include "golden_static_bending.inc"

TEST(Static, DecodesTheGoldenStreamWithABendingAngle) {
    const MeshSequence clip = bending_clip();
    const MeshSequence decoded = decode(clip, kGoldenStaticBending);
    ASSERT_EQ(decoded.positions.size(), kGoldenStaticBendingPositions.size());
    for (std::size_t k = 0; k < decoded.positions.size(); ++k)
        EXPECT_EQ(std::bit_cast<std::uint32_t>(decoded.positions[k]), kGoldenStaticBendingPositions[k]) << k;
}

}  // namespace
}  // namespace batchenc
