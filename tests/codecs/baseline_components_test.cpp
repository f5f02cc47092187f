#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "codecs/baselines/coded_motion.h"
#include "codecs/baselines/trajectory_clusters.h"
#include "codecs/integer_contexts.h"
#include "tests/codecs/baseline_support.h"

namespace batchenc {
namespace {

using test::decode, test::decode_components, test::encode, test::largest_distance_of, test::rmse_of,
    test::side_of, test::step_of;
const SerialExecutor kSerial;
constexpr CodecMethod kMethods[] = {CodecMethod::kBaselinePca, CodecMethod::kBaselinePcaLpc,
                                    CodecMethod::kBaselineCpca};

CodecParameters parameters_of(CodecMethod method, std::int32_t components, int bits) {
    return {.method = method,
            .bits = bits,
            .components = components,
            .basis_bits = bits,
            .coefficient_bits = bits};
}

/// Turns fast and walks, without a change of shape.
std::array<double, 3> tumble(const std::array<double, 3>& p, double time) {
    const double a = 9.0 * time, b = 4.0 * time;
    const std::array<double, 3> q = {std::cos(a) * p[0] - std::sin(a) * p[1],
                                     std::sin(a) * p[0] + std::cos(a) * p[1], p[2]};
    return {std::cos(b) * q[0] - std::sin(b) * q[2] + 2.0 * time, q[1] - time,
            std::sin(b) * q[0] + std::cos(b) * q[2]};
}

/// A shape and three others that are added in changing amounts.
std::array<double, 3> blend(const std::array<double, 3>& p, double time) {
    const double a = std::sin(6.0 * time), b = std::cos(11.0 * time), c = time * time;
    return {p[0] + 0.1 * b * std::sin(9.0 * p[1]), p[1] + 0.08 * c * p[0] * p[0],
            p[2] + 0.2 * a * std::cos(5.0 * p[0])};
}

TEST(BaselineComponents, RoundTripEveryKindOfClip) {
    for (const auto& [name, clip] : test::every_kind_of_clip()) {
        const double side = side_of(clip);
        for (const CodecMethod method : kMethods) {
            for (const auto& [components, bits] : {std::pair<std::int32_t, int>{1, 12}, {3, 4}, {60, 16}}) {
                for (const std::int32_t clusters : {1, 5}) {
                    const auto bytes = encode(clip, parameters_of(method, components, bits), clusters);
                    const MeshSequence decoded = decode(clip, bytes);
                    for (const float value : decoded.positions) ASSERT_TRUE(std::isfinite(value)) << name;
                    const double error = test::largest_distance(clip.view(), decoded.view());
                    // All components there can be: what is left is rounding.
                    EXPECT_LE(error, (components >= 60 ? 2e-3 : 1.5) * side + 1e-5)
                        << name << ", " << to_name(method) << ", " << components << ", " << clusters;
                }
            }
        }
    }
}

TEST(BaselineComponents, ErrorFallsWithComponentsAndBits) {
    const MeshSequence clip = test::sheet(20, 20, 40);
    const double side = side_of(clip);
    for (const CodecMethod method : kMethods) {
        double last = 1e9;
        for (const std::int32_t components : {1, 2, 4, 8, 16}) {
            const double error = rmse_of(clip, encode(clip, parameters_of(method, components, 16)));
            EXPECT_LT(error, last) << to_name(method) << ", " << components;
            last = error;
        }
        EXPECT_LT(last, 1e-4 * side) << to_name(method);
        last = 1e9;
        for (const int bits : {6, 8, 10, 12, 14}) {
            const double error = rmse_of(clip, encode(clip, parameters_of(method, 30, bits)));
            EXPECT_LT(error, 0.7 * last) << to_name(method) << ", " << bits;
            last = error;
        }
    }
}

TEST(BaselineComponents, BodyNeedsNoComponents) {
    const MeshSequence clip = test::sheet(15, 12, 50, tumble);
    for (const CodecMethod method : {CodecMethod::kBaselinePca, CodecMethod::kBaselinePcaLpc}) {
        const auto bytes = encode(clip, parameters_of(method, 20, 12));
        const MeshSequence decoded = decode(clip, bytes);
        const double step = step_of(clip, 12);
        EXPECT_LT(test::largest_distance(clip.view(), decoded.view()), step);
        EXPECT_EQ(decode_components(clip, bytes, 0).positions, decoded.positions);
        EXPECT_LE(read_clip_info(bytes)->section_bytes.coefficients, 1) << "an empty stream";
    }
}

TEST(BaselineComponents, ClipOfRankThreeNeedsThreeComponents) {
    const MeshSequence clip = test::sheet(16, 14, 45, blend);
    const double side = side_of(clip);
    const auto error_of = [&](CodecMethod method, std::int32_t components, std::int32_t clusters) {
        return rmse_of(clip, encode(clip, parameters_of(method, components, 16), clusters));
    };
    EXPECT_GT(error_of(CodecMethod::kBaselineCpca, 2, 1), 1e-3 * side);
    EXPECT_LT(error_of(CodecMethod::kBaselineCpca, 3, 1), 1e-4 * side);

    // Alignment bends the space of shapes; it is left out for a clip whose best motion is no motion, such as
    // one that is the same in a mirror along every axis.
    MeshSequence mirrored;
    const std::vector<std::array<double, 3>> rest = {{1, 0, 0},  {-1, 0, 0}, {0, 1, 0},
                                                     {0, -1, 0}, {0, 0, 1},  {0, 0, -1}};
    mirrored = test::animate(rest, {{0, 2, 4}, {1, 4, 2}, {0, 4, 3}, {0, 5, 2}}, 40,
                             [](const std::array<double, 3>& p, double time) {
                                 return std::array<double, 3>{p[0] * (1.0 + 0.3 * std::sin(7.0 * time)),
                                                              p[1] * (1.0 + 0.2 * std::cos(3.0 * time)),
                                                              p[2] * (1.0 + 0.3 * time)};
                             });
    for (const CodecMethod method : {CodecMethod::kBaselinePca, CodecMethod::kBaselinePcaLpc}) {
        const double extent = side_of(mirrored);
        const auto bytes = encode(mirrored, parameters_of(method, 3, 16));
        EXPECT_LT(rmse_of(mirrored, bytes), 1e-4 * extent);
        EXPECT_GT(test::rmse(mirrored.view(), decode_components(mirrored, bytes, 2).view()), 1e-3 * extent);
    }
}

TEST(BaselineComponents, PredictionAlongTimePays) {
    const MeshSequence clip = test::sheet(12, 12, 150);
    const auto plain = encode(clip, parameters_of(CodecMethod::kBaselinePca, 8, 12));
    std::size_t last = plain.size();
    for (const std::int32_t order : {1, 2}) {
        CodecParameters parameters = parameters_of(CodecMethod::kBaselinePcaLpc, 8, 12);
        parameters.lpc_order = order;
        const auto bytes = encode(clip, parameters);
        EXPECT_LT(bytes.size(), last) << order;
        last = bytes.size();
        EXPECT_EQ(decode(clip, bytes).positions, decode(clip, plain).positions);
    }
}

TEST(BaselineComponents, SameBytesForAnyExecutor) {
    for (const CodecMethod method : kMethods) {
        SCOPED_TRACE(to_name(method));
        test::expect_same_for_any_executor(test::sheet(25, 20, 22), parameters_of(method, 7, 12), 6);
    }
}

TEST(BaselineComponents, DecodeAnyRangeOfFrames) {
    const MeshSequence clip = test::sheet(9, 8, 37);
    for (const CodecMethod method : kMethods)
        test::expect_any_range_decodes(encode(clip, parameters_of(method, 5, 12)), clip);
}

TEST(BaselineComponents, DecodeTheFirstComponents) {
    const MeshSequence clip = test::sheet(16, 16, 40);
    for (const CodecMethod method : kMethods) {
        SCOPED_TRACE(to_name(method));
        test::expect_components_help(clip, encode(clip, parameters_of(method, 12, 14)), {0, 1, 2, 4, 6});
    }
}

TEST(BaselineComponents, InfoTellsTheParameters) {
    const MeshSequence clip = test::sheet(8, 8, 9);
    CodecParameters parameters = parameters_of(CodecMethod::kBaselinePcaLpc, 5, 11);
    parameters.lpc_order = 1;
    const auto whole = read_clip_info(encode(clip, parameters));
    ASSERT_TRUE(whole);
    EXPECT_EQ(whole->cluster_count, 0);
    EXPECT_EQ(whole->parameters.components, 5);
    EXPECT_EQ(whole->parameters.basis_bits, 11);
    EXPECT_EQ(whole->parameters.lpc_order, 1);
    EXPECT_GT(whole->section_bytes.frames, 0);
    const auto bytes = encode(clip, parameters_of(CodecMethod::kBaselineCpca, 5, 11), 3);
    const auto clustered = read_clip_info(bytes);
    ASSERT_TRUE(clustered);
    EXPECT_GE(clustered->cluster_count, 1);
    EXPECT_LE(clustered->cluster_count, 3);
    EXPECT_EQ(clustered->section_bytes.frames, 0);
    const auto decoded = decode_clip(bytes, clip.triangles, -1, test::kLimit, kSerial);
    ASSERT_TRUE(decoded);
    EXPECT_EQ(static_cast<std::int64_t>((*decoded)->labels().size()), clip.vertex_count);
}

TEST(BaselineComponents, RefuseWhatFloat32CannotCarry) {
    for (const CodecMethod method : kMethods) {
        SCOPED_TRACE(to_name(method));
        test::expect_refused_or_close(parameters_of(method, 12, 14), 1);
    }
}

TEST(BaselineComponents, RefuseDamage) {
    const MeshSequence clip = test::sheet(5, 4, 6);
    for (const CodecMethod method : kMethods)
        test::expect_damage_is_refused(encode(clip, parameters_of(method, 3, 8), 2), clip);
}

TEST(BaselineComponents, SurviveChangesBehindValidChecksums) {
    const MeshSequence clip = test::sheet(6, 5, 9);
    for (const CodecMethod method : kMethods)
        test::expect_changes_are_survived(encode(clip, parameters_of(method, 3, 8), 3), clip);
}

TEST(BaselineComponents, RefuseCountsAndMemory) {
    const MeshSequence clip = test::sheet(14, 14, 9);
    for (const CodecMethod method : kMethods)
        test::expect_counts_and_memory_are_refused(encode(clip, parameters_of(method, 3, 8)), clip);
}

// ---- parts ----

TEST(CodedMotion, FollowsABody) {
    const MeshSequence clip = test::sheet(9, 7, 60, tumble);
    const BoundingBox box = bounding_box(clip.view());
    const auto side = static_cast<float>(box.largest_side());
    CodedMotion motion(box.center(), side);
    motion.set_best(clip.view());
    const auto bytes = motion.write();
    CodedMotion read(box.center(), side);
    ASSERT_TRUE(read.read(bytes, clip.frame_count));
    const LocalFrameTrack track = read.track();
    EXPECT_EQ(track.values, motion.track().values);
    const std::vector<std::int32_t> some = {0, 20, 62};
    std::vector<float> first(9), other(9);
    to_local(clip.view().at(0, 0), some, track, 0, first.data());
    for (std::int64_t f = 1; f < clip.frame_count; ++f) {
        to_local(clip.view().at(f, 0), some, track, f, other.data());
        for (std::size_t k = 0; k < 9; ++k) EXPECT_NEAR(other[k], first[k], 1e-4f * side) << f;
    }
    EXPECT_FALSE(read.read(bytes, clip.frame_count - 1));
    EXPECT_FALSE(read.read({}, clip.frame_count));
}

TEST(TrajectoryClusters, FindWhatMovesAlike) {
    // Two halves of one sheet, each with motions of its own, and labels that say nothing of them.
    const MeshSequence clip = test::sheet(20, 10, 40, [](const std::array<double, 3>& p, double time) {
        const bool left = p[0] < 0.5;
        const double a = std::sin((left ? 7.0 : 12.0) * time), b = std::cos((left ? 3.0 : 19.0) * time);
        return std::array<double, 3>{p[0] * (1.0 + 0.5 * a), p[1] * (1.0 + 0.5 * b), p[2] + 0.3 * a * p[1]};
    });
    std::vector<std::int32_t> labels;
    for (std::int64_t v = 0; v < clip.vertex_count; ++v)
        labels.push_back(clip.view().at(0, v)[0] < 0.7f ? 0 : v % 5 == 0 ? 2 : 1);
    const auto clusters = TrajectoryClusters::of(clip.view(), labels, 3, 3, kSerial);
    ASSERT_TRUE(clusters);
    ASSERT_LE(clusters->count, 3);
    std::set<std::int32_t> left, right;
    for (std::int64_t v = 0; v < clip.vertex_count; ++v)
        (v % 20 < 10 ? left : right).insert(clusters->labels[static_cast<std::size_t>(v)]);
    for (const std::int32_t label : left) EXPECT_EQ(right.count(label), 0u);
    for (const std::uint64_t seed : {1u, 2u}) {
        const auto again = TrajectoryClusters::of(clip.view(), labels, 3, 3, ShuffledExecutor(seed));
        ASSERT_TRUE(again);
        EXPECT_EQ(again->labels, clusters->labels);
    }
}

TEST(FittedSeries, RoundTripAndFit) {
    std::vector<std::int32_t> wave, steady(50, 7), shortest = {-5};
    for (int t = 0; t < 300; ++t)
        wave.push_back(static_cast<std::int32_t>(std::lround(3e5 * std::sin(0.3 * t))));
    const auto weights = fit_weights(wave, 2);
    EXPECT_NEAR(weights[0], 2.0 * std::cos(0.3), 1e-3);  // what a sine obeys
    EXPECT_NEAR(weights[1], -1.0, 1e-3);
    EXPECT_NEAR(fit_weights(steady, 1)[0], 1.0, 1e-6);
    EXPECT_EQ(fit_weights(shortest, 2).size(), 2u);
    for (const int order : {1, 2}) {
        RangeEncoder encoder;
        SeriesContexts contexts;
        for (const auto& series : {wave, steady, shortest})
            encode_fitted(encoder, contexts, fit_weights(series, order), series);
        const auto bytes = encoder.finish();
        auto decoder = RangeDecoder::open(bytes);
        ASSERT_TRUE(decoder);
        SeriesContexts others;
        for (const auto& series : {wave, steady, shortest}) {
            std::vector<std::int32_t> decoded(series.size());
            ASSERT_TRUE(decode_fitted(*decoder, others, fit_weights(series, order), decoded));
            EXPECT_EQ(decoded, series);
        }
        EXPECT_TRUE(decoder->finish());
    }
}

}  // namespace
}  // namespace batchenc
