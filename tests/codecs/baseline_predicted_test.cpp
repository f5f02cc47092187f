#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "codecs/baselines/baseline_header.h"
#include "codecs/baselines/level_grid.h"
#include "tests/codecs/baseline_support.h"

namespace batchenc {
namespace {

using test::decode, test::encode, test::kLimit, test::sections_of;
using enum GeometryPredictor;
const SerialExecutor kSerial;

CodecParameters with(CodecMethod method, std::int32_t bits, GeometryPredictor predictor = kAuto,
                     std::int32_t lpc_order = 2) {
    return {.method = method, .bits = bits, .predictor = predictor, .lpc_order = lpc_order};
}

std::vector<CodecParameters> every_way(std::int32_t bits) {
    return {with(CodecMethod::kBaselineStatic, bits),
            with(CodecMethod::kBaselineLpc, bits, kAuto, 1),
            with(CodecMethod::kBaselineLpc, bits, kAuto, 2),
            with(CodecMethod::kBaselineDynapack, bits, kLorenzo),
            with(CodecMethod::kBaselineDynapack, bits, kReplica),
            with(CodecMethod::kBaselineDynapack, bits),
            with(CodecMethod::kBaselineAngle, bits)};
}

std::string name_of(const CodecParameters& parameters) {
    return std::string(to_name(parameters.method)) + ", " + std::string(to_name(parameters.predictor)) +
           ", order " + std::to_string(parameters.lpc_order) + ", " + std::to_string(parameters.bits) +
           " bits";
}

TEST(BaselinePredicted, IsNoFartherThanHalfAStepInEveryKindOfClip) {
    for (const auto& [name, clip] : test::every_kind_of_clip()) {
        for (const std::int32_t bits : {4, 9, 14, 20}) {
            for (const CodecParameters& parameters : every_way(bits)) {
                const MeshSequence decoded = decode(clip, encode(clip, parameters));
                const double step = BaselineHeader::of(clip.view(), parameters)->step();
                double excess = 0.0;
                for (std::size_t k = 0; k < clip.positions.size(); ++k) {
                    const double source = clip.positions[k];
                    const double off = std::abs(source - static_cast<double>(decoded.positions[k]));
                    excess = std::max(excess, off - 0.5 * step - std::ldexp(std::abs(source), -23));
                    if (!std::isfinite(off)) excess = off;
                }
                EXPECT_LE(excess, 1e-6 * step) << name << ", " << name_of(parameters);
            }
        }
    }
}

TEST(BaselinePredicted, RoundsAlikeWhateverThePredictor) {
    const MeshSequence clip = test::sheet(12, 10, 17);
    const MeshSequence decoded = decode(clip, encode(clip, with(CodecMethod::kBaselineStatic, 9)));
    for (const CodecParameters& parameters : every_way(9))
        EXPECT_EQ(decode(clip, encode(clip, parameters)).positions, decoded.positions) << name_of(parameters);
}

// ---- hand-worked residuals ----

using Rows = std::vector<std::int32_t>;

/// The residuals in a stream, of which every place must be the vertex of that number.
Rows residuals_in(const MeshSequence& clip, const CodecParameters& parameters) {
    const MeshTraversal traversal = MeshTraversal::of(clip.triangles, clip.vertex_count);
    for (std::size_t k = 0; k < traversal.order.size(); ++k)
        EXPECT_EQ(traversal.order[k], static_cast<std::int32_t>(k));
    EXPECT_EQ(BaselineHeader::of(clip.view(), parameters)->step(), 1.0);
    const auto bytes = encode(clip, parameters);
    const auto parsed = parse_clip_bitstream(bytes);
    const auto rows =
        decode_level_grid(parsed->payload(SectionId::kResiduals), clip.frame_count, clip.vertex_count);
    EXPECT_TRUE(rows);
    return rows ? *rows : Rows{};
}

/// A strip of three triangles. Vertex 3 hangs on (1, 2) behind which is 0, 4 on (2, 3) behind which is 1.
MeshSequence strip(std::vector<std::vector<float>> frames) {
    MeshSequence clip;
    clip.vertex_count = 5;
    clip.frame_count = static_cast<std::int64_t>(frames.size());
    clip.triangles = {{0, 1, 2}, {2, 1, 3}, {2, 3, 4}};
    for (const auto& frame : frames) clip.positions.insert(clip.positions.end(), frame.begin(), frame.end());
    return clip;
}

void expect_rows(const Rows& rows, std::size_t first_row, const Rows& expected, const char* what) {
    ASSERT_GE(rows.size(), 15 * first_row + expected.size()) << what;
    EXPECT_EQ(Rows(rows.begin() + static_cast<std::ptrdiff_t>(15 * first_row),
                   rows.begin() + static_cast<std::ptrdiff_t>(15 * first_row + expected.size())),
              expected)
        << what;
}

TEST(BaselinePredicted, HandWorkedResidualsInSpaceAndTime) {
    // In units of the step, as the box is 14 × 32 × 6 about (7, 16, 3). Vertices move by (1, 0, 0),
    // (1, 2, 0), (3, 0, 0), (0, 0, 4), (2, 1, 2), and then each by (1, 1, 2).
    const MeshSequence clip = strip({{0, 0, 0, 8, 0, 0, 4, 8, 0, 13, 8, 0, 8, 30, 2},
                                     {1, 0, 0, 9, 2, 0, 7, 8, 0, 13, 8, 4, 10, 31, 4},
                                     {2, 1, 2, 10, 3, 2, 8, 9, 2, 14, 9, 6, 11, 32, 6}});
    // From the centre; from 0; from the middle of 0 and 1; from 1 + 2 - 0; from 2 + 3 - 1.
    const Rows first = {-7, -16, -3, 8, 0, 0, 0, 8, 0, 1, 0, 0, -1, 14, 2};
    const Rows moves = {1, 0, 0, 1, 2, 0, 3, 0, 0, 0, 0, 4, 2, 1, 2};
    for (const CodecParameters& parameters : every_way(5))
        expect_rows(residuals_in(clip, parameters), 0, first, name_of(parameters).c_str());

    expect_rows(residuals_in(clip, with(CodecMethod::kBaselineStatic, 5)), 1,
                {-6, -16, -3, 8, 2, 0, 2, 7, 0, -2, -2, 4, -1, 17, 0}, "static");
    const Rows order_1 = residuals_in(clip, with(CodecMethod::kBaselineLpc, 5, kAuto, 1));
    expect_rows(order_1, 1, moves, "order 1");
    expect_rows(order_1, 2, {1, 1, 2, 1, 1, 2, 1, 1, 2, 1, 1, 2, 1, 1, 2}, "order 1");
    const Rows order_2 = residuals_in(clip, with(CodecMethod::kBaselineLpc, 5, kAuto, 2));
    expect_rows(order_2, 1, moves, "order 2");
    expect_rows(order_2, 2, {0, 1, 2, 0, -1, 2, -2, 1, 2, 1, 1, -2, -1, 0, 0}, "order 2");
    // The first two by themselves; the third against the middle of their moves, (1, 1, 0); the fourth against
    // (1, 2, 0) + (3, 0, 0) - (1, 0, 0), the fifth against (3, 0, 0) + (0, 0, 4) - (1, 2, 0).
    const Rows lorenzo = residuals_in(clip, with(CodecMethod::kBaselineDynapack, 5, kLorenzo));
    expect_rows(lorenzo, 1, {1, 0, 0, 1, 2, 0, 2, -1, 0, -3, -2, 4, 0, 3, -2}, "lorenzo");
    expect_rows(lorenzo, 2, {1, 1, 2, 1, 1, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0}, "lorenzo");
}

TEST(BaselinePredicted, HandWorkedResidualsOfATurn) {
    // A quarter turn about z, and 20 along x.
    const MeshSequence clip = strip({{0, 0, 0, 8, 0, 0, 4, 8, 0, 12, 8, 0, 8, 32, 2},
                                     {20, 0, 0, 20, 8, 0, 12, 4, 0, 12, 12, 0, -12, 8, 2}});
    const Rows found = {20, 0, 0, 12, 8, 0, -8, -8, 0, 0, 0, 0, 0, 0, 0};
    expect_rows(residuals_in(clip, with(CodecMethod::kBaselineAngle, 5)), 1, found, "angle");
    expect_rows(residuals_in(clip, with(CodecMethod::kBaselineDynapack, 5, kReplica)), 1, found, "replica");
    // The fifth against (8, -4, 0) + (0, 4, 0) - (12, 8, 0).
    expect_rows(residuals_in(clip, with(CodecMethod::kBaselineDynapack, 5, kLorenzo)), 1,
                {20, 0, 0, 12, 8, 0, -8, -8, 0, 0, 0, 0, -16, -16, 0}, "lorenzo");
}

TEST(BaselinePredicted, HandWorkedResidualsOfGrowth) {
    const MeshSequence clip = strip({{0, 0, 0, 8, 0, 0, 4, 8, 0, 12, 8, 0, 8, 32, 2},
                                     {0, 0, 0, 16, 0, 0, 8, 16, 0, 24, 16, 0, 16, 64, 4}});
    const Rows begin = {0, 0, 0, 8, 0, 0, 0, 8, 0};
    const auto expect = [&](const CodecParameters& parameters, const Rows& last) {
        Rows expected = begin;
        expected.insert(expected.end(), last.begin(), last.end());
        expect_rows(residuals_in(clip, parameters), 1, expected, name_of(parameters).c_str());
    };
    // Replica grows along, in every direction; the others keep lengths: from the gate's middle, and from the
    // parallelogram.
    expect(with(CodecMethod::kBaselineDynapack, 6, kReplica), {0, 0, 0, 0, 0, 0});
    expect(with(CodecMethod::kBaselineAngle, 6), {6, 4, 0, 0, 24, 2});
    expect(with(CodecMethod::kBaselineDynapack, 6, kLorenzo), {0, 0, 0, 0, 16, 2});
    EXPECT_EQ(read_clip_info(encode(clip, with(CodecMethod::kBaselineDynapack, 6)))->parameters.predictor,
              kReplica);
}

TEST(BaselinePredicted, AngleTakesTheMeanOfItsGates) {
    // Vertex 4 hangs on (0, 2) and (0, 3), behind both of which is 1. Nothing moves but 3, along the second
    // gate, whose middle moves by (-8, 0, 0): so does what is seen from it.
    MeshSequence clip;
    clip.vertex_count = 5;
    clip.frame_count = 2;
    clip.triangles = {{0, 1, 2}, {1, 0, 3}, {0, 2, 4}, {3, 0, 4}};
    clip.positions = {0, 0, 0, 0, 16, 0, 32, 0, 0, -16, 0, 0, 0, -16, 0,
                      0, 0, 0, 0, 16, 0, 32, 0, 0, -32, 0, 0, 0, -16, 0};
    const MeshTraversal traversal = MeshTraversal::of(clip.triangles, clip.vertex_count);
    ASSERT_EQ(traversal.gates_of(4).size(), 2u);
    const Rows rows = residuals_in(clip, with(CodecMethod::kBaselineAngle, 6));
    ASSERT_EQ(rows.size(), 30u);
    EXPECT_EQ(Rows(rows.end() - 3, rows.end()), (Rows{4, 0, 0}));
}

// ---- streams ----

TEST(BaselinePredicted, GivesTheSameBytesAndFramesForAnyThreads) {
    for (const CodecParameters& parameters : every_way(11)) {
        SCOPED_TRACE(name_of(parameters));
        test::expect_same_for_any_executor(test::sheet(12, 10, 17), parameters);
    }
}

TEST(BaselinePredicted, DecodesAnyRangeOfFrames) {
    const MeshSequence clip = test::sheet(7, 6, 37);
    for (const CodecParameters& parameters : every_way(10))
        test::expect_any_range_decodes(encode(clip, parameters), clip);
}

TEST(BaselinePredicted, SaysWhatItWasCodedWith) {
    const MeshSequence clip = test::sheet(6, 5, 4);
    for (const CodecParameters& parameters : every_way(10)) {
        const auto info = read_clip_info(encode(clip, parameters));
        ASSERT_TRUE(info);
        EXPECT_EQ(info->method, parameters.method);
        EXPECT_EQ(info->parameters.bits, 10);
        EXPECT_EQ(info->parameters.lpc_order, parameters.lpc_order);
        EXPECT_EQ(info->cluster_count, 0);
        EXPECT_EQ(info->component_count, 0);
        const bool is_chosen = parameters.method == CodecMethod::kBaselineDynapack;
        if (is_chosen && parameters.predictor == kAuto) {
            EXPECT_TRUE(info->parameters.predictor == kLorenzo || info->parameters.predictor == kReplica);
        } else {
            EXPECT_EQ(info->parameters.predictor, parameters.predictor);
        }
    }
}

TEST(BaselinePredicted, AutoIsTheSmallerOfDynapacksTwo) {
    for (const MeshSequence& clip : {test::sheet(12, 10, 17), test::walker(500, 20)}) {
        const auto size = [&](GeometryPredictor predictor) {
            return encode(clip, with(CodecMethod::kBaselineDynapack, 12, predictor)).size();
        };
        EXPECT_EQ(size(kAuto), std::min(size(kLorenzo), size(kReplica)));
    }
}

TEST(BaselinePredicted, RefusesEveryTruncationAndFlippedBitAndExtraByte) {
    const MeshSequence clip = test::sheet(4, 3, 4);
    for (const CodecParameters& parameters : every_way(8))
        test::expect_damage_is_refused(encode(clip, parameters), clip);
}

TEST(BaselinePredicted, SurvivesChangesBehindValidChecksums) {
    for (const CodecParameters& parameters : every_way(10))
        test::expect_changes_are_survived(test::sheet(5, 4, 6), parameters);
}

TEST(BaselinePredicted, RefusesCountsAndMemoryBeforeAllocating) {
    const MeshSequence clip = test::sheet(6, 5, 9);
    for (const CodecParameters& parameters : every_way(8))
        test::expect_counts_and_memory_are_refused(encode(clip, parameters), clip);
}

TEST(BaselinePredicted, StaysOnTheLatticeAndFiniteWhateverTheResiduals) {
    const MeshSequence clip = test::sheet(5, 4, 6);
    constexpr std::int32_t kMost = std::numeric_limits<std::int32_t>::max();
    constexpr float kLargest = std::numeric_limits<float>::max(), kFurthest = 1 << 29;
    Rows rows(clip.positions.size());
    for (std::size_t k = 0; k < rows.size(); ++k) {
        const std::int32_t values[] = {kMost, -kMost, 1 << 29, -7, kMost, 0, -(1 << 30)};
        rows[k] = values[k * k % 7];
    }
    for (const CodecParameters& parameters : every_way(4)) {
        auto sections = sections_of(encode(clip, parameters));
        sections[5].second = encode_level_grid(rows, clip.vertex_count);
        auto header = *BaselineHeader::read(sections[0].second);
        const auto farthest = [&](const std::array<float, 3>& center, float side) {
            header.center = center;
            header.largest_side = side;
            sections[0].second = header.write();
            const auto bytes =
                write_clip_bitstream(parameters.method, clip.vertex_count, clip.frame_count, sections);
            const MeshSequence decoded = decode(clip, bytes);
            float most = 0.0f;
            for (const float x : decoded.positions) {
                if (!std::isfinite(x)) return std::numeric_limits<float>::infinity();
                most = std::max(most, std::abs(x));
            }
            return most;
        };
        EXPECT_EQ(farthest({0.0f, 0.0f, 0.0f}, 16.0f), kFurthest) << name_of(parameters);  // steps of 1
        EXPECT_EQ(farthest({kLargest, -kLargest, 0.0f}, kLargest), kLargest) << name_of(parameters);
    }
}

TEST(BaselinePredicted, RefusesPredictorsOfOthers) {
    const MeshSequence clip = test::sheet(5, 4, 3);
    for (const CodecParameters& parameters : every_way(8)) {
        auto sections = sections_of(encode(clip, parameters));
        auto header = *BaselineHeader::read(sections[0].second);
        const bool chooses = parameters.method == CodecMethod::kBaselineDynapack;
        for (const GeometryPredictor predictor : {kAuto, kMultiway, kLorenzo, kReplica}) {
            header.predictor = predictor;
            sections[0].second = header.write();
            const auto bytes =
                write_clip_bitstream(parameters.method, clip.vertex_count, clip.frame_count, sections);
            const bool good = chooses ? predictor == kLorenzo || predictor == kReplica : predictor == kAuto;
            EXPECT_EQ(decode_clip(bytes, clip.triangles, -1, kLimit, kSerial).has_value(), good)
                << name_of(parameters) << " as " << to_name(predictor);
        }
    }
    EXPECT_EQ(test::try_to_encode(clip, with(CodecMethod::kBaselineAngle, 8, kReplica)).error().code,
              ErrorCode::kInvalidArgument);
}

}  // namespace
}  // namespace batchenc
