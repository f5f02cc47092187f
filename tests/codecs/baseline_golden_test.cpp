#include <gtest/gtest.h>

#include "tests/codecs/baseline_support.h"

namespace batchenc {
namespace {

using enum CodecMethod;
using GeometryPredictor::kLorenzo, GeometryPredictor::kReplica;
constexpr auto kNone = GeometryPredictor::kAuto;

// ---- what earlier versions wrote ----

#include "golden_baselines_v1.inc"

/// A stream, what it says of itself, and what it decodes to.
struct Golden {
    const std::vector<std::uint8_t>& bytes;
    CodecMethod method;
    GeometryPredictor predictor;
    std::int32_t clusters;
    std::int32_t components;
    std::uint32_t checksum;  ///< of the positions
    double rmse;             ///< from the source, world units
};

// Those that predict points of one lattice decode to the same. A step is 0.0225, which is what errors are
// below but where three components are too few.
const Golden kGoldens[] = {
    {kGoldenStatic, kBaselineStatic, kNone, 0, 0, 0xd2b531d3, 0.010316109074},
    {kGoldenLpc, kBaselineLpc, kNone, 0, 0, 0xd2b531d3, 0.010316109074},
    {kGoldenLorenzo, kBaselineDynapack, kLorenzo, 0, 0, 0xd2b531d3, 0.010316109074},
    {kGoldenReplica, kBaselineDynapack, kReplica, 0, 0, 0xd2b531d3, 0.010316109074},
    {kGoldenAngle, kBaselineAngle, kNone, 0, 0, 0xd2b531d3, 0.010316109074},
    {kGoldenPca, kBaselinePca, kNone, 0, 3, 0x6b55cd11, 0.079518472674},
    {kGoldenPcaLpc, kBaselinePcaLpc, kNone, 0, 3, 0x6b55cd11, 0.079518472674},
    {kGoldenCpca, kBaselineCpca, kNone, 2, 3, 0xcdaf2e91, 0.074441022410},
    {kGoldenCoddyac, kBaselineCoddyac, kNone, 0, 3, 0xfd256a69, 0.105388391102},
    {kGoldenAffine, kBaselineAffine, kNone, 2, 0, 0x3edd73a2, 0.008315201126},
    {kGoldenOctree, kBaselineOctree, kNone, 0, 0, 0x1f3a6735, 0.005321199506},
    {kGoldenWavelet, kBaselineWavelet, kNone, 0, 0, 0xe0b47dec, 0.010444086616},
};

void expect_golden(const MeshSequence& clip, const Golden& golden) {
    SCOPED_TRACE(std::string(to_name(golden.method)) + ", " + std::string(to_name(golden.predictor)));
    const auto info = read_clip_info(golden.bytes);
    ASSERT_TRUE(info) << info.error().to_string();
    EXPECT_EQ(info->method, golden.method);
    EXPECT_EQ(info->parameters.predictor, golden.predictor);
    EXPECT_EQ(info->cluster_count, golden.clusters);
    EXPECT_EQ(info->component_count, golden.components);

    const MeshSequence decoded = test::decode(clip, golden.bytes);
    EXPECT_EQ(test::checksum_of(decoded), golden.checksum);
    EXPECT_NEAR(test::rmse(clip.view(), decoded.view()), golden.rmse, 1e-9);
}

TEST(BaselineGolden, DecodesTheStreamsOfVersion1) {
    const MeshSequence clip = test::golden_clip(4, 3, 10);
    for (const Golden& golden : kGoldens) expect_golden(clip, golden);
}

TEST(BaselineGolden, DecodesTheStreamOfPoints) {
    MeshSequence clip = test::golden_clip(4, 3, 10);
    clip.triangles.clear();
    expect_golden(clip, {kGoldenCoddyacPoints, kBaselineCoddyac, kNone, 0, 3, 0xfd256a69, 0.105388391102});
}

}  // namespace
}  // namespace batchenc
