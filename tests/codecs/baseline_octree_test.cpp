#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "codecs/baselines/baseline_header.h"
#include "tests/codecs/baseline_support.h"

namespace batchenc {
namespace {

using test::encode, test::extent_of, test::largest_distance_of, test::step_of;

CodecParameters at(std::int32_t bits) { return {.method = CodecMethod::kBaselineOctree, .bits = bits}; }

std::size_t motion_size(std::span<const std::uint8_t> bytes) {
    return parse_clip_bitstream(bytes)->payload(SectionId::kResiduals).size();
}

TEST(BaselineOctree, LeavesNoVertexFartherThanAStepFromItsSource) {
    for (const auto& [name, clip] : test::every_kind_of_clip()) {
        for (const std::int32_t bits : {4, 9, 14, 20})
            EXPECT_LE(largest_distance_of(clip, encode(clip, at(bits))),
                      step_of(clip, bits) + 2e-7 * extent_of(clip))
                << name << ", " << bits << " bits";
    }
}

TEST(BaselineOctree, TranslationCostsNextToNothing) {
    const auto moved = [](const std::array<double, 3>& p, double time) {
        return std::array<double, 3>{p[0] + 5.0 * time, p[1] + std::sin(9.0 * time), p[2] - time * time};
    };
    const MeshSequence few = test::sheet(8, 8, 40, moved), many = test::sheet(40, 40, 40, moved);
    // One cell a frame, whatever the number of vertices.
    EXPECT_LT(motion_size(encode(many, at(12))), 39 * 5 + 32);
    EXPECT_LT(motion_size(encode(few, at(12))), 39 * 5 + 32);
}

TEST(BaselineOctree, CornersOfOneCellCarryATrilinearMotion) {
    // Every coordinate moves by a product of coordinates, slowly enough that cells stay where they are.
    const auto sheared = [](const std::array<double, 3>& p, double time) {
        return std::array<double, 3>{p[0] + 0.05 * time * p[1], p[1] - 0.05 * time * p[0] * p[1],
                                     p[2] + 0.05 * time * p[0]};
    };
    const MeshSequence few = test::sheet(20, 20, 12, sheared), many = test::sheet(60, 60, 12, sheared);
    const std::size_t size = motion_size(encode(many, at(10)));
    EXPECT_LT(size, 11 * 24 * 2 + 64);  // less than two bytes for each number at the corners of one cell
    EXPECT_LT(motion_size(encode(few, at(10))), 11 * 24 * 2 + 64);
}

TEST(BaselineOctree, MoreBitsCostMoreAndHelp) { test::expect_bits_help(test::walker(600, 40), at(6)); }

TEST(BaselineOctree, ManyVerticesInOnePlaceAreTakenApart) {
    // All start at one point, which no cell divides, and go where each wants.
    MeshSequence clip;
    clip.vertex_count = 50;
    clip.frame_count = 4;
    for (std::int64_t f = 0; f < clip.frame_count; ++f)
        for (std::int64_t v = 0; v < clip.vertex_count; ++v)
            for (std::int64_t c = 0; c < 3; ++c)
                clip.positions.push_back(static_cast<float>(f * ((v * 31 + c * 17 + v * v * c) % 23)) / 8.0f);
    EXPECT_LE(largest_distance_of(clip, encode(clip, at(12))), 1.001 * step_of(clip, 12));
}

TEST(BaselineOctree, SameBytesForAnyExecutor) {
    test::expect_same_for_any_executor(test::sheet(13, 9, 25), at(11));
}

TEST(BaselineOctree, DecodesAnyRangeOfFrames) {
    const MeshSequence clip = test::sheet(9, 8, 37);
    test::expect_any_range_decodes(encode(clip, at(10)), clip);
}

// ---- hostile bytes ----

TEST(BaselineOctree, RejectsEveryTruncationAndFlippedBitAndExtraByte) {
    const MeshSequence clip = test::sheet(4, 3, 4);
    test::expect_damage_is_refused(encode(clip, at(7)), clip);
}

TEST(BaselineOctree, SurvivesChangesBehindValidChecksums) {
    test::expect_changes_are_survived(test::sheet(6, 5, 7), at(9));
}

TEST(BaselineOctree, RefusesCountsAndMemoryBeforeAllocating) {
    const MeshSequence clip = test::sheet(6, 5, 9);
    test::expect_counts_and_memory_are_refused(encode(clip, at(8)), clip);
}

TEST(BaselineOctree, DividesACellAtTheEndOfTheLattice) {
    const SerialExecutor serial;
    const MeshSequence clip = test::sheet(9, 8, 5);
    auto sections = test::sections_of(encode(clip, at(14)));
    // Steps so small that along x the vertices stand at both ends of the lattice, along y all at one: the
    // cube around them reaches beyond it, and so do its children.
    BaselineHeader header = *BaselineHeader::read(sections[0].second);
    header.largest_side = 1e-30f;
    header.center = {0.3f, -100.0f, 0.0f};
    sections[0].second = header.write();
    const auto whole =
        write_clip_bitstream(CodecMethod::kBaselineOctree, clip.vertex_count, clip.frame_count, sections);
    const auto decoded = decode_clip(whole, clip.triangles, -1, test::kLimit, serial);
    if (!decoded) return;
    std::vector<float> out(clip.positions.size());
    EXPECT_TRUE((*decoded)->reconstruct(0, {out.data(), clip.frame_count, clip.vertex_count}, serial));
    EXPECT_TRUE(std::all_of(out.begin(), out.end(), [](float x) { return std::isfinite(x); }));
}

TEST(BaselineOctree, RefusesMotionOfASingleFrame) { test::expect_motion_of_a_single_frame_is_refused(at(8)); }

}  // namespace
}  // namespace batchenc
