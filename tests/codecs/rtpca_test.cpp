#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "codecs/clip_codec.h"
#include "codecs/rtpca.h"
#include "kernels/bounding_box.h"
#include "kernels/error_metrics.h"
#include "tests/codecs/codec_support.h"
#include "tests/support/sample_clips.h"
#include "tests/support/thread_executor.h"

namespace batchenc {
namespace {

using test::decode, test::golden_clip, test::kLimit, test::rmse;
const SerialExecutor kSerial;

struct Setting {
    std::int32_t clusters;
    double step;
};
const Setting kSettings[] = {{1, 1e-3}, {4, 1e-4}, {3, 2e-6}, {200, 1e-2}, {2, 0.3}};

CodecParameters at_step(double step) {
    CodecParameters parameters;
    parameters.method = CodecMethod::kRtpca;
    parameters.step = step;
    return parameters;
}

Expected<EncodedClip> try_encode(const MeshSequence& clip, std::int32_t clusters,
                                 const CodecParameters& parameters, const Executor& executor = kSerial) {
    SegmentationParameters segmentation_parameters;
    segmentation_parameters.clusters = clusters;
    const auto segmentation = segment_clip(clip.view(), clip.triangles, segmentation_parameters, executor);
    if (!segmentation) return tl::unexpected(segmentation.error());
    return encode_clip(clip.view(), clip.triangles, *segmentation, parameters, executor);
}

std::vector<std::uint8_t> encode(const MeshSequence& clip, std::int32_t clusters,
                                 const CodecParameters& parameters, const Executor& executor = kSerial) {
    const auto encoded = try_encode(clip, clusters, parameters, executor);
    EXPECT_TRUE(encoded) << encoded.error().to_string();
    if (!encoded) return {};
    EXPECT_EQ(encoded->section_bytes.total(), static_cast<std::int64_t>(encoded->bitstream.size()));
    return encoded->bitstream;
}

std::vector<std::uint8_t> encode(const MeshSequence& clip, const Setting& setting,
                                 const Executor& executor = kSerial) {
    return encode(clip, setting.clusters, at_step(setting.step), executor);
}

/// What float32 may round away.
double rounding(const MeshSequence& clip) {
    const BoundingBox box = bounding_box(clip.view());
    double offset = 0.0;
    for (const float value : box.center()) offset += std::abs(static_cast<double>(value));
    return 4e-7 * (offset + box.largest_side());
}

TEST(Rtpca, RoundTripsEveryKindOfClip) {
    for (const auto& [name, clip] : test::every_kind_of_clip()) {
        const double side = bounding_box(clip.view()).largest_side();
        for (const Setting& setting : kSettings) {
            const MeshSequence decoded = decode(clip, encode(clip, setting));
            for (const float value : decoded.positions) ASSERT_TRUE(std::isfinite(value)) << name;
            EXPECT_LE(rmse(clip.view(), decoded.view()), 1.5 * setting.step * side + rounding(clip))
                << name << ", " << setting.clusters << " clusters, step " << setting.step;
        }
    }
}

TEST(Rtpca, FinerStepsCostMoreAndHelp) {
    const MeshSequence clip = test::walker(1000, 40);
    double last = std::numeric_limits<double>::infinity();
    std::size_t size = 0;
    for (const double step : {1e-2, 1e-3, 1e-4, 1e-5}) {
        const auto bytes = encode(clip, {6, step});
        const double error = rmse(clip.view(), decode(clip, bytes).view());
        EXPECT_LT(3.0 * error, last) << step;
        EXPECT_GT(bytes.size(), size) << step;
        last = error;
        size = bytes.size();
    }
}

// A body that only turns and moves is a motion and a shape, and no component.
TEST(Rtpca, RigidMotionTakesNoComponents) {
    const MeshSequence clip = test::sheet(12, 12, 60, [](const std::array<double, 3>& p, double time) {
        const double c = std::cos(5.0 * time), s = std::sin(5.0 * time);
        return std::array<double, 3>{c * p[0] - s * p[1] + time, s * p[0] + c * p[1], p[2] - 2.0 * time};
    });
    const auto bytes = encode(clip, {1, 1e-3});
    EXPECT_EQ(read_clip_info(bytes)->component_count, 0);
    EXPECT_LE(rmse(clip.view(), decode(clip, bytes).view()), 1e-3 * bounding_box(clip.view()).largest_side());
}

// Hundreds of turns are as good as one.
TEST(Rtpca, TakesBodiesThatSpin) {
    constexpr double kTurns = 1000.0;
    const MeshSequence clip = test::sheet(10, 10, 2400, [](const std::array<double, 3>& p, double time) {
        const double angle = 2.0 * std::numbers::pi * kTurns * time;
        const double c = std::cos(angle), s = std::sin(angle), x = p[0] - 0.5, y = p[1] - 0.5;
        return std::array<double, 3>{c * x - s * y, s * x + c * y, p[2]};
    });
    for (const double step : {1e-3, 1e-6}) {
        const auto bytes = encode(clip, {1, step});
        const double side = bounding_box(clip.view()).largest_side();
        EXPECT_LE(rmse(clip.view(), decode(clip, bytes).view()), 1.5 * step * side + rounding(clip)) << step;
        EXPECT_LE(read_clip_info(bytes)->component_count, step > 1e-4 ? 0 : 8) << step;
    }
}

TEST(Rtpca, SameBytesForAnyExecutor) {
    const MeshSequence clip = test::sheet(30, 20, 25);
    CodecParameters bounded;
    bounded.method = CodecMethod::kRtpca;
    bounded.max_error_relative = 1e-3;
    for (const CodecParameters& parameters : {at_step(1e-4), bounded}) {
        const auto expected = encode(clip, 9, parameters);
        const MeshSequence decoded = decode(clip, expected);
        for (std::uint64_t seed = 0; seed < 3; ++seed) {
            const ShuffledExecutor shuffled(seed);
            ASSERT_EQ(encode(clip, 9, parameters, shuffled), expected) << "seed " << seed;
            ASSERT_EQ(decode(clip, expected, shuffled).positions, decoded.positions) << seed;
        }
        const test::ThreadExecutor threads(3);
        EXPECT_EQ(encode(clip, 9, parameters, threads), expected);
        EXPECT_EQ(decode(clip, expected, threads).positions, decoded.positions);
    }
}

TEST(Rtpca, DecodesAnyRangeOfFrames) {
    MeshSequence clip = test::sheet(9, 8, 37);
    CodecParameters bounded = at_step(1e-2);
    bounded.max_error_relative = 1e-3;
    for (const bool points : {false, true}) {
        if (points) clip.triangles.clear();
        for (const CodecParameters& parameters : {at_step(1e-2), at_step(1e-5), bounded}) {
            test::expect_any_range_decodes(encode(clip, 3, parameters), clip);
        }
    }
}

TEST(Rtpca, TheFirstComponentsAreAClip) {
    const MeshSequence clip = test::synthetic("jelly", 1000, 40);
    CodecParameters parameters = at_step(1e-4);
    parameters.max_error_relative = 1e-3;
    for (const bool bounded : {false, true}) {
        if (!bounded) parameters.max_error_relative = 0.0;
        const auto bytes = encode(clip, 6, parameters);
        const std::int32_t count = read_clip_info(bytes)->component_count;
        ASSERT_GT(count, 20);
        const MeshSequence whole = decode(clip, bytes);
        double last = std::numeric_limits<double>::infinity();
        const double first_error = [&] {
            MeshSequence part = clip;
            EXPECT_TRUE((*decode_clip(bytes, clip.triangles, 0, kLimit, kSerial))
                            ->reconstruct(0, part.view(), kSerial));
            return rmse(clip.view(), part.view());
        }();
        for (std::int32_t k = 0; k <= count; k += k < 8 || k == count ? 1 : std::min(11, count - k)) {
            const auto decoded = decode_clip(bytes, clip.triangles, k, kLimit, kSerial);
            ASSERT_TRUE(decoded) << k << ": " << decoded.error().to_string();
            MeshSequence part = clip;
            ASSERT_TRUE((*decoded)->reconstruct(0, part.view(), kSerial));
            const double error = rmse(clip.view(), part.view());
            EXPECT_LE(error, last) << k << " components";
            last = error;
            if (k == count) {
                EXPECT_EQ(part.positions, whole.positions);
            }
        }
        EXPECT_LT(20.0 * last, first_error);
        const auto more = decode_clip(bytes, clip.triangles, count + 5, kLimit, kSerial);
        ASSERT_TRUE(more);
        MeshSequence all = clip;
        ASSERT_TRUE((*more)->reconstruct(0, all.view(), kSerial));
        EXPECT_EQ(all.positions, whole.positions);
    }
}

TEST(Rtpca, HitsItsTargets) {
    for (const char* kind : {"walker", "jelly"}) {
        const MeshSequence clip = test::synthetic(kind, 500, 30);
        const auto encode_to = [&](auto set) {
            CodecParameters parameters = at_step(2e-4);
            set(parameters);
            return encode(clip, 7, parameters);
        };
        const auto measured = [&](const std::vector<std::uint8_t>& bytes) {
            ErrorMeter meter(clip.vertex_count);
            const MeshSequence decoded = decode(clip, bytes);
            meter.add(clip.view(), decoded.view(), kSerial);
            return meter.finish();
        };
        for (const double target : {0.03, 0.5}) {
            const double kg = measured(encode_to([&](CodecParameters& p) { p.target_kg = target; })).kg;
            EXPECT_LE(kg, target) << kind;
            EXPECT_GE(kg, 0.9 * target) << kind;
            const double da = measured(encode_to([&](CodecParameters& p) { p.target_da = target; })).da;
            EXPECT_LE(da, target) << kind;
            EXPECT_GE(da, 0.9 * target) << kind;
        }
        const double places = static_cast<double>(clip.vertex_count * clip.frame_count);
        for (const double target : {3.0, 8.0}) {
            const auto bytes = encode_to([&](CodecParameters& p) { p.target_bpvf = target; });
            const double rate = 8.0 * static_cast<double>(bytes.size()) / places;
            EXPECT_LE(rate, target) << kind;
            EXPECT_GE(rate, 0.9 * target) << kind;
        }
    }
}

TEST(Rtpca, SaysWhatTargetIsOutOfReach) {
    const MeshSequence clip = test::walker(300, 10);
    const auto code_of = [&](auto set) {
        CodecParameters parameters = at_step(2e-4);
        set(parameters);
        const auto encoded = try_encode(clip, 3, parameters);
        return encoded ? ErrorCode::kInternal : encoded.error().code;
    };
    EXPECT_EQ(code_of([](CodecParameters& p) { p.target_bpvf = 0.01; }), ErrorCode::kLimit);
    EXPECT_EQ(code_of([](CodecParameters& p) { p.target_kg = 1e-9; }), ErrorCode::kLimit);
}

TEST(Rtpca, KeepsABoundOnEveryKindOfClip) {
    for (const auto& [name, clip] : test::every_kind_of_clip()) {
        const double diagonal = bounding_box(clip.view()).diagonal();
        for (const double part : {0.2, 0.01, 7e-4}) {
            CodecParameters parameters = at_step(2e-4);
            parameters.max_error_relative = part;
            const auto bytes = encode(clip, 4, parameters);
            EXPECT_LE(test::largest_distance(clip.view(), decode(clip, bytes).view()), part * diagonal)
                << name << ", " << part;
            if (diagonal == 0.0) continue;
            EXPECT_EQ(read_clip_info(bytes)->parameters.max_error, part * diagonal);
            parameters.max_error_relative = 0.0;
            parameters.max_error = part * diagonal;
            EXPECT_EQ(encode(clip, 4, parameters), bytes) << name;
        }
    }
}

TEST(Rtpca, SegmentsIntoAsManyClustersAsPay) {
    const MeshSequence clip = test::walker(500, 30);
    const MeshTopology mesh(clip.triangles, clip.vertex_count);
    SegmentationParameters segmentation_parameters;
    const CodecParameters parameters = at_step(1e-3);
    const auto segmentation =
        segment_for_rtpca(clip.view(), mesh, segmentation_parameters, parameters, kSerial);
    ASSERT_TRUE(segmentation) << segmentation.error().to_string();
    EXPECT_GT(segmentation->cluster_count(), 1);
    const auto best = encode_clip(clip.view(), mesh, *segmentation, parameters, kSerial);
    ASSERT_TRUE(best);
    EXPECT_LT(best->bitstream.size(), encode(clip, {1, 1e-3}).size());
    EXPECT_LT(best->bitstream.size(), encode(clip, {60, 1e-3}).size());
    const ShuffledExecutor shuffled(5);
    EXPECT_EQ(segment_for_rtpca(clip.view(), mesh, segmentation_parameters, parameters, shuffled)->labels,
              segmentation->labels);
    for (const auto& [name, other] : test::every_kind_of_clip()) {
        const MeshTopology topology(other.triangles, other.vertex_count);
        const auto division =
            segment_for_rtpca(other.view(), topology, segmentation_parameters, parameters, kSerial);
        ASSERT_TRUE(division) << name << ": " << division.error().to_string();
        EXPECT_EQ(division->labels.size(), static_cast<std::size_t>(other.vertex_count)) << name;
    }
}

TEST(Rtpca, RefusesWhatFloat32CannotCarry) {
    for (const double size : {1e-44, 1e-36, 1e-12, 1e12, 1e18, 1e34, 1.6e38}) {
        const MeshSequence clip = test::sheet(8, 8, 12, [size](const std::array<double, 3>& p, double time) {
            const auto q = test::bend(p, time);
            return std::array<double, 3>{0.2 * size * q[0], 0.2 * size * q[1], 0.2 * size * q[2]};
        });
        const auto encoded = try_encode(clip, 3, at_step(2e-4));
        if (!encoded) {
            EXPECT_EQ(encoded.error().code, ErrorCode::kLimit) << size;
            EXPECT_TRUE(size < 1e-20 || size > 1e20) << size;
            continue;
        }
        // What a component moves a vertex by in one step has few digits left where float32 begins to lose
        // them.
        const double part = size < 1e-20 ? 0.02 : 0.001;
        EXPECT_LE(rmse(clip.view(), decode(clip, encoded->bitstream).view()),
                  part * bounding_box(clip.view()).largest_side() + 1e-44)
            << size;
    }
}

TEST(Rtpca, RefusesNaNAndParametersOutsideTheirRange) {
    MeshSequence clip = test::sheet(5, 5, 4);
    const auto segmentation = segment_clip(clip.view(), clip.triangles, {}, kSerial);
    clip.positions[100] = std::numeric_limits<float>::quiet_NaN();
    const auto encoded = encode_clip(clip.view(), clip.triangles, *segmentation, at_step(1e-3), kSerial);
    ASSERT_FALSE(encoded);
    EXPECT_EQ(encoded.error().code, ErrorCode::kNotFinite);
    ASSERT_TRUE(check_parameters(at_step(1e-7)));
    ASSERT_TRUE(check_parameters(at_step(1.0)));
    for (const double step : {0.0, 0.9e-7, 1.1, -1.0, std::nan("")}) {
        const auto checked = check_parameters(at_step(step));
        ASSERT_FALSE(checked) << step;
        EXPECT_EQ(checked.error().code, ErrorCode::kInvalidArgument);
    }
}

TEST(Rtpca, SaysWhatItIs) {
    const MeshSequence clip = test::sheet(9, 8, 12);
    const auto info = read_clip_info(encode(clip, {3, 1e-3}));
    ASSERT_TRUE(info);
    EXPECT_EQ(info->method, CodecMethod::kRtpca);
    EXPECT_EQ(info->vertex_count, 72);
    EXPECT_EQ(info->frame_count, 12);
    EXPECT_EQ(info->cluster_count, 3);
    EXPECT_GT(info->component_count, 0);
    EXPECT_NEAR(info->parameters.step, 1e-3, 1e-9);
    EXPECT_EQ(info->parameters.max_error, 0.0);
}

// ---- what earlier versions wrote ----

#include "golden_rtpca_v1.inc"

// Positions come out in the same bits on every machine, so that a bound holds on all of them; a second
// decoder has found these checksums too (tests/app/independent_decoder.py).
void expect_golden(const MeshSequence& clip, std::span<const std::uint8_t> bitstream,
                   std::uint32_t expected) {
    EXPECT_EQ(test::checksum_of(decode(clip, bitstream)), expected);
}

TEST(Rtpca, DecodesTheGoldenStreamOfVersion1) {
    const MeshSequence clip = golden_clip(9, 7, 40);
    expect_golden(clip, kGoldenRtpcaMesh, 0x14b58a38);
    EXPECT_NEAR(rmse(clip.view(), decode(clip, kGoldenRtpcaMesh).view()), 0.272915786966, 1e-6);
}

TEST(Rtpca, DecodesTheGoldenStreamWithABound) {
    const MeshSequence clip = golden_clip(9, 7, 14);
    expect_golden(clip, kGoldenRtpcaBounded, 0xc738e718);
    EXPECT_LE(test::largest_distance(clip.view(), decode(clip, kGoldenRtpcaBounded).view()),
              read_clip_info(kGoldenRtpcaBounded)->parameters.max_error);
}

TEST(Rtpca, DecodesTheGoldenStreamOfPoints) {
    MeshSequence clip = golden_clip(8, 8, 12);
    clip.triangles.clear();
    expect_golden(clip, kGoldenRtpcaPoints, 0x83d939f6);
}

}  // namespace
}  // namespace batchenc
