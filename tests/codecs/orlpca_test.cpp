#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "kernels/bounding_box.h"
#include "kernels/byte_stream.h"
#include "kernels/error_metrics.h"
#include "tests/codecs/codec_support.h"
#include "tests/support/sample_clips.h"
#include "tests/support/thread_executor.h"

namespace batchenc {
namespace {

using test::decode;
using test::kLimit;

const SerialExecutor kSerial;

CodecParameters orlpca(CodecTarget target, double value, std::int32_t most_components = 64) {
    CodecParameters parameters;
    parameters.method = CodecMethod::kOrlpca;
    parameters.components = most_components;
    if (target == CodecTarget::kKg) parameters.target_kg = value;
    if (target == CodecTarget::kDa) parameters.target_da = value;
    if (target == CodecTarget::kBpvf) parameters.target_bpvf = value;
    if (target == CodecTarget::kComponents) parameters.target_components = static_cast<std::int32_t>(value);
    return parameters;
}

Segmentation segmentation_of(const MeshSequence& clip, std::int32_t clusters,
                             const Executor& executor = kSerial) {
    SegmentationParameters parameters;
    parameters.clusters = clusters;
    return segment_clip(clip.view(), clip.triangles, parameters, executor).value();
}

Expected<EncodedClip> try_encode(const MeshSequence& clip, std::int32_t clusters,
                                 const CodecParameters& parameters, const Executor& executor = kSerial) {
    return encode_clip(clip.view(), clip.triangles, segmentation_of(clip, clusters, executor), parameters,
                       executor);
}

std::vector<std::uint8_t> encode(const MeshSequence& clip, std::int32_t clusters,
                                 const CodecParameters& parameters, const Executor& executor = kSerial) {
    auto encoded = try_encode(clip, clusters, parameters, executor);
    EXPECT_TRUE(encoded) << encoded.error().to_string();
    return encoded ? std::move(encoded->bitstream) : std::vector<std::uint8_t>();
}

ErrorMetrics errors_of(const MeshSequence& clip, const MeshSequence& decoded) {
    ErrorMeter meter(clip.vertex_count);
    meter.add(clip.view(), decoded.view(), kSerial);
    return meter.finish();
}

double bpvf_of(const MeshSequence& clip, std::span<const std::uint8_t> bytes) {
    return 8.0 * static_cast<double>(bytes.size()) /
           static_cast<double>(clip.vertex_count * clip.frame_count);
}

/// Components of each cluster, from the table that begins section 4.
std::vector<std::int64_t> counts_of(std::span<const std::uint8_t> bytes) {
    const auto clip = parse_clip_bitstream(bytes).value();
    ByteReader reader(clip.payload(SectionId::kBasis));
    std::vector<std::int64_t> counts;
    for (std::int32_t i = 0; i < read_clip_info(bytes)->cluster_count; ++i) {
        counts.push_back(static_cast<std::int64_t>(reader.get_varint(4096).value()));
        if (counts.back() > 0) (void)reader.get_array<float, 2>();
    }
    return counts;
}

std::int64_t total_of(std::span<const std::uint8_t> bytes) {
    const auto counts = counts_of(bytes);
    return std::accumulate(counts.begin(), counts.end(), std::int64_t{0});
}

/// A sheet whose one half is at rest and whose other half moves in more ways the farther out it is.
MeshSequence uneven_sheet() {
    return test::sheet(30, 24, 48, [](const std::array<double, 3>& p, double time) {
        std::array<double, 3> q = p;
        const double far = std::max(0.0, p[0] - 0.4);
        for (int wave = 1; wave < 12; ++wave)
            q[2] += far * 0.6 * std::sin(wave * (9.0 * p[1] + 5.0 * time) + wave * wave * time);
        return q;
    });
}

TEST(Orlpca, RoundTripsEveryKindOfClip) {
    for (const auto& [name, clip] : test::every_kind_of_clip()) {
        const double side = bounding_box(clip.view()).largest_side();
        for (const RateMeasure rate : {RateMeasure::kBits, RateMeasure::kVectors}) {
            for (const CoordinateSpace space : {CoordinateSpace::kLocal, CoordinateSpace::kWorld}) {
                for (const std::int32_t budget : {1, 7, 1000000}) {
                    CodecParameters parameters = orlpca(CodecTarget::kComponents, budget);
                    parameters.rate = rate;
                    parameters.space = space;
                    parameters.basis_bits = parameters.coefficient_bits = 16;
                    const auto bytes = encode(clip, 5, parameters);
                    EXPECT_LE(total_of(bytes), budget) << name;
                    const MeshSequence decoded = decode(clip, bytes);
                    for (const float value : decoded.positions) ASSERT_TRUE(std::isfinite(value)) << name;
                    const double error = test::largest_distance(clip.view(), decoded.view());
                    EXPECT_LE(error, (budget > 1000 ? 2e-3 : 1.5) * side + 1e-5) << name;
                }
                CodecParameters large =
                    orlpca(CodecTarget::kBpvf, 1000.0 + 1e6 / static_cast<double>(clip.vertex_count));
                large.space = space;
                large.rate = rate;
                const auto bytes = encode(clip, 3, large);
                EXPECT_LE(test::largest_distance(clip.view(), decode(clip, bytes).view()), 0.02 * side + 1e-5)
                    << name;
            }
        }
    }
}

TEST(Orlpca, KeepsTargetsOfError) {
    const MeshSequence uneven = uneven_sheet(), walker = test::walker(3000, 80);
    for (const MeshSequence* clip : {&uneven, &walker}) {
        for (const RateMeasure rate : {RateMeasure::kBits, RateMeasure::kVectors}) {
            for (const double target : {3.0, 0.5, 0.1}) {
                for (const CodecTarget which : {CodecTarget::kDa, CodecTarget::kKg}) {
                    CodecParameters parameters = orlpca(which, target);
                    parameters.rate = rate;
                    parameters.basis_bits = parameters.coefficient_bits = 16;
                    const ErrorMetrics errors =
                        errors_of(*clip, decode(*clip, encode(*clip, 12, parameters)));
                    const double reached = which == CodecTarget::kDa ? errors.da : errors.kg;
                    EXPECT_LE(reached, target);
                    // A component of so small a sheet is a large step.
                    EXPECT_GE(reached, (clip == &walker ? 0.85 : 0.45) * target)
                        << to_name(which) << " " << to_name(rate) << " of " << clip->vertex_count;
                }
            }
        }
    }
}

TEST(Orlpca, KeepsTargetsOfSize) {
    const MeshSequence uneven = uneven_sheet(), walker = test::walker(3000, 80);
    for (const MeshSequence* clip : {&uneven, &walker}) {
        for (const RateMeasure rate : {RateMeasure::kBits, RateMeasure::kVectors}) {
            const double least = bpvf_of(*clip, encode(*clip, 12, orlpca(CodecTarget::kComponents, 1)));
            for (const double target : {least + 0.5, least + 2.0, least + 4.0}) {
                CodecParameters parameters = orlpca(CodecTarget::kBpvf, target);
                parameters.rate = rate;
                const double reached = bpvf_of(*clip, encode(*clip, 12, parameters));
                EXPECT_LE(reached, target);
                EXPECT_GE(reached, (clip == &walker ? 0.95 : 0.8) * target)
                    << to_name(rate) << " of " << clip->vertex_count;
            }
        }
    }
}

TEST(Orlpca, SpendsItsBudgetOfComponents) {
    const MeshSequence clip = uneven_sheet();
    for (const RateMeasure rate : {RateMeasure::kBits, RateMeasure::kVectors}) {
        for (const std::int32_t budget : {1, 2, 5, 11, 40}) {
            CodecParameters parameters = orlpca(CodecTarget::kComponents, budget);
            parameters.rate = rate;
            EXPECT_EQ(total_of(encode(clip, 8, parameters)), budget);
        }
        CodecParameters capped = orlpca(CodecTarget::kComponents, 40, 7);
        capped.rate = rate;
        for (const std::int64_t count : counts_of(encode(clip, 8, capped))) EXPECT_LE(count, 7);
    }
}

TEST(Orlpca, GivesRestingClustersLess) {
    const MeshSequence clip = uneven_sheet();
    auto counts = counts_of(encode(clip, 8, orlpca(CodecTarget::kComponents, 64)));
    std::sort(counts.begin(), counts.end());
    EXPECT_LE(counts.front(), 2);
    EXPECT_GE(counts.back(), 10);
}

TEST(Orlpca, TakesFewerBitsThanRlpca) {
    const MeshSequence clip = uneven_sheet();
    for (const std::int32_t components : {4, 8}) {
        CodecParameters same_for_all;
        same_for_all.components = components;
        const auto plain = encode(clip, 8, same_for_all);
        const double da = errors_of(clip, decode(clip, plain)).da;
        for (const auto& [rate, part] :
             {std::pair{RateMeasure::kBits, 0.94}, {RateMeasure::kVectors, 0.97}}) {
            CodecParameters parameters = orlpca(CodecTarget::kDa, da);
            parameters.rate = rate;
            EXPECT_LE(static_cast<double>(encode(clip, 8, parameters).size()),
                      part * static_cast<double>(plain.size()))
                << components << " " << to_name(rate);
        }
    }
}

TEST(Orlpca, CodesClustersAsRlpcaDoes) {
    const MeshSequence clip = test::sheet(16, 16, 40);
    CodecParameters plain;
    plain.components = 6;
    const auto all = encode(clip, 4, orlpca(CodecTarget::kComponents, 24, 6));
    const auto all_of_rlpca = encode(clip, 4, plain);
    const auto expected = parse_clip_bitstream(all_of_rlpca).value();
    const auto found = parse_clip_bitstream(all).value();
    EXPECT_EQ(found.method, CodecMethod::kOrlpca);
    for (std::size_t i = 1; i < kSectionCount; ++i)  // but for the header
        EXPECT_TRUE(std::equal(found.payloads[i].begin(), found.payloads[i].end(),
                               expected.payloads[i].begin(), expected.payloads[i].end()))
            << "section " << i + 1;
}

TEST(Orlpca, RefusesTargetsBeyondReach) {
    const MeshSequence clip = uneven_sheet();
    const auto message_of = [&](const MeshSequence& of, const CodecParameters& parameters) {
        const auto encoded = try_encode(of, 8, parameters);
        EXPECT_FALSE(encoded);
        if (encoded) return std::string();
        EXPECT_EQ(encoded.error().code, ErrorCode::kInvalidArgument);
        return encoded.error().message;
    };
    EXPECT_NE(message_of(clip, orlpca(CodecTarget::kDa, 1e-9)).find("beyond reach"), std::string::npos);
    EXPECT_NE(message_of(clip, orlpca(CodecTarget::kKg, 0.01, 2)).find("codec.components 2"),
              std::string::npos);
    EXPECT_NE(message_of(clip, orlpca(CodecTarget::kBpvf, 1e-3)).find("beyond reach"), std::string::npos);
    const MeshSequence resting =
        test::sheet(8, 8, 12, [](const std::array<double, 3>& p, double) { return p; });
    EXPECT_NE(message_of(resting, orlpca(CodecTarget::kDa, 0.1)).find("nothing in it moves"),
              std::string::npos);
    EXPECT_TRUE(try_encode(resting, 3, orlpca(CodecTarget::kKg, 0.5)));
}

// Sizes whose squares float32 does not hold: the target is kept, or the clip is refused as by RLPCA.
TEST(Orlpca, KeepsTargetsAtAnySize) {
    for (const double size : {1e-44, 1e-30, 1e-20, 1e-12, 1e12, 1e18, 1e20, 1e30, 1e37}) {
        const MeshSequence clip =
            test::sheet(12, 12, 12, [size](const std::array<double, 3>& p, double time) {
                const auto q = test::bend(p, time);
                return std::array<double, 3>{0.2 * size * q[0], 0.2 * size * q[1], 0.2 * size * q[2]};
            });
        CodecParameters parameters = orlpca(CodecTarget::kDa, 1.0);
        parameters.space = CoordinateSpace::kWorld;
        const auto encoded = try_encode(clip, 1, parameters);
        if (encoded) {
            const double da = errors_of(clip, decode(clip, encoded->bitstream)).da;
            EXPECT_LE(da, 1.0) << size;
            EXPECT_GE(total_of(encoded->bitstream), 2) << size;
        } else {
            EXPECT_TRUE(encoded.error().code == ErrorCode::kLimit ||
                        encoded.error().code == ErrorCode::kInvalidArgument)
                << size << ": " << encoded.error().to_string();
            EXPECT_TRUE(size < 1e-19 || size > 1e19) << size << ": " << encoded.error().to_string();
        }
    }
}

TEST(Orlpca, SameBytesForAnyExecutorAndThreads) {
    const MeshSequence clip = uneven_sheet();
    for (const auto& parameters : {orlpca(CodecTarget::kDa, 2.0), orlpca(CodecTarget::kBpvf, 4.0),
                                   orlpca(CodecTarget::kComponents, 30)}) {
        const auto expected = encode(clip, 9, parameters);
        EXPECT_EQ(encode(clip, 9, parameters), expected);
        for (std::uint64_t seed = 0; seed < 3; ++seed)
            ASSERT_EQ(encode(clip, 9, parameters, ShuffledExecutor(seed)), expected) << "seed " << seed;
        ASSERT_EQ(encode(clip, 9, parameters, test::ThreadExecutor(4)), expected);
    }
}

TEST(Orlpca, DecodesTheFirstComponents) {
    const MeshSequence clip = uneven_sheet();
    const auto bytes = encode(clip, 6, orlpca(CodecTarget::kComponents, 60));
    double last = 1e9;
    for (const std::int32_t components : {1, 2, 4, 8, 64}) {
        const auto part = decode_clip(bytes, clip.triangles, components, kLimit, kSerial);
        ASSERT_TRUE(part);
        MeshSequence decoded = clip;
        ASSERT_TRUE((*part)->reconstruct(0, decoded.view(), kSerial));
        const double error = errors_of(clip, decoded).rmse;
        EXPECT_LT(error, last) << components;
        last = error;
        if (components == 64) {
            EXPECT_EQ(decoded.positions, decode(clip, bytes).positions);
        }
    }
}

TEST(Orlpca, InfoTellsTheParameters) {
    const MeshSequence clip = uneven_sheet();
    const auto bytes = encode(clip, 6, orlpca(CodecTarget::kComponents, 25));
    const auto info = read_clip_info(bytes).value();
    EXPECT_EQ(info.method, CodecMethod::kOrlpca);
    EXPECT_EQ(info.parameters.method, CodecMethod::kOrlpca);
    EXPECT_EQ(info.cluster_count, 6);
    const auto counts = counts_of(bytes);
    EXPECT_EQ(info.component_count, *std::max_element(counts.begin(), counts.end()));
    EXPECT_EQ(info.section_bytes.total(), static_cast<std::int64_t>(bytes.size()));
}

// ---- hostile bytes ----

std::vector<std::uint8_t> small_stream(const MeshSequence& clip) {
    CodecParameters parameters = orlpca(CodecTarget::kComponents, 7);
    parameters.basis_bits = parameters.coefficient_bits = 8;
    return encode(clip, 3, parameters);
}

bool decodes(std::span<const std::uint8_t> bytes, const MeshSequence& like) {
    return decode_clip(bytes, like.triangles, -1, kLimit, kSerial).has_value();
}

TEST(Orlpca, RejectsEveryTruncationAndExtraBytes) {
    const MeshSequence clip = test::sheet(5, 4, 6);
    auto bytes = small_stream(clip);
    ASSERT_TRUE(decodes(bytes, clip));
    for (std::size_t size = 0; size < bytes.size(); ++size) {
        const std::vector<std::uint8_t> shorter(bytes.begin(),
                                                bytes.begin() + static_cast<std::ptrdiff_t>(size));
        EXPECT_FALSE(decodes(shorter, clip)) << size;
    }
    bytes.push_back(0);
    EXPECT_FALSE(decodes(bytes, clip));
}

TEST(Orlpca, RejectsEveryFlippedBit) {
    const MeshSequence clip = test::sheet(5, 4, 6);
    auto bytes = small_stream(clip);
    for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
        bytes[bit / 8] ^= static_cast<std::uint8_t>(1u << (bit % 8));
        EXPECT_FALSE(decodes(bytes, clip)) << "bit " << bit;
        bytes[bit / 8] ^= static_cast<std::uint8_t>(1u << (bit % 8));
    }
}

TEST(Orlpca, SurvivesChangesBehindValidChecksums) {
    const MeshSequence clip = test::sheet(6, 5, 9);
    const auto sections = test::sections_of(small_stream(clip));
    for (std::size_t section = 0; section < sections.size(); ++section) {
        for (std::size_t at = 0; at < sections[section].second.size(); ++at) {
            for (const std::uint8_t change : {std::uint8_t{0x01}, std::uint8_t{0x80}, std::uint8_t{0xff}}) {
                auto changed = sections;
                changed[section].second[at] ^= change;
                const auto bytes =
                    write_clip_bitstream(CodecMethod::kOrlpca, clip.vertex_count, clip.frame_count, changed);
                const auto decoded = decode_clip(bytes, clip.triangles, -1, kLimit, kSerial);
                if (!decoded) continue;
                std::vector<float> out(clip.positions.size());
                EXPECT_TRUE(
                    (*decoded)->reconstruct(0, {out.data(), clip.frame_count, clip.vertex_count}, kSerial));
            }
        }
    }
}

TEST(Orlpca, RefusesMoreComponentsThanItsHeaderSays) {
    const MeshSequence clip = uneven_sheet();
    auto sections = test::sections_of(encode(clip, 6, orlpca(CodecTarget::kComponents, 60)));
    sections[0].second[4] -= 1;  // the header's count, in one byte
    EXPECT_FALSE(decodes(
        write_clip_bitstream(CodecMethod::kOrlpca, clip.vertex_count, clip.frame_count, sections), clip));
}

#include "golden_orlpca_v1.inc"

// Decodes for ever: a change of format adds a file beside it.
TEST(Orlpca, DecodesTheGoldenStreamOfVersion1) {
    const MeshSequence clip = test::golden_sheet();
    EXPECT_EQ(counts_of(kGoldenOrlpcaV1), (std::vector<std::int64_t>{1, 5}));
    EXPECT_NEAR(errors_of(clip, decode(clip, kGoldenOrlpcaV1)).da, 0.0500019645, 1e-9);
}

TEST(Orlpca, RejectsNaN) {
    MeshSequence clip = test::sheet(5, 5, 6);
    const Segmentation segmentation = segmentation_of(clip, 2);
    clip.positions[100] = std::numeric_limits<float>::quiet_NaN();
    const auto encoded =
        encode_clip(clip.view(), clip.triangles, segmentation, orlpca(CodecTarget::kDa, 1.0), kSerial);
    ASSERT_FALSE(encoded);
    EXPECT_EQ(encoded.error().code, ErrorCode::kNotFinite);
}

}  // namespace
}  // namespace batchenc
