#include "core/parameters.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <string>
#include <vector>

namespace batchenc {
namespace {

TEST(Parameters, DefaultsAreAccepted) {
    EXPECT_TRUE(check_parameters(SegmentationParameters{}).has_value());
    EXPECT_TRUE(check_parameters(CodecParameters{}).has_value());
}

TEST(Parameters, NumbersAndNamesArePinned) {
    // The numbers stand in bitstreams, the names in job files.
    const std::pair<int, const char*> codecs[] = {{1, "static"},
                                                  {2, "splitcoder"},
                                                  {3, "rlpca"},
                                                  {0, "auto"},
                                                  {4, "orlpca"},
                                                  {5, "pdct"},
                                                  {6, "rtpca"},
                                                  {16, "baseline-static"},
                                                  {17, "baseline-lpc"},
                                                  {18, "baseline-dynapack"},
                                                  {19, "baseline-angle"},
                                                  {20, "baseline-pca"},
                                                  {21, "baseline-pca-lpc"},
                                                  {22, "baseline-cpca"},
                                                  {23, "baseline-coddyac"},
                                                  {24, "baseline-affine"},
                                                  {25, "baseline-octree"},
                                                  {26, "baseline-wavelet"}};
    for (const auto& [number, name] : codecs) EXPECT_EQ(to_name(static_cast<CodecMethod>(number)), name);
    const std::pair<int, const char*> segmentations[] = {
        {1, "region-growing"}, {2, "clustering"}, {3, "adaptive"}, {4, "rigid"}};
    for (const auto& [number, name] : segmentations) {
        EXPECT_EQ(to_name(static_cast<SegmentationMethod>(number)), name);
    }
    EXPECT_EQ(to_name(static_cast<CoordinateSpace>(0)), "local");
    EXPECT_EQ(to_name(static_cast<CoordinateSpace>(1)), "world");
    for (const int number : {7, 15, 27, 255}) EXPECT_EQ(to_name(static_cast<CodecMethod>(number)), "unknown");
    EXPECT_EQ(to_name(static_cast<SegmentationMethod>(0)), "unknown");
    EXPECT_EQ(to_name(static_cast<CoordinateSpace>(2)), "unknown");
}

struct Range {
    const char* name;
    std::int32_t CodecParameters::*member;
    std::int32_t low, high;
};

TEST(Parameters, CodecRangesAreExact) {
    const Range ranges[] = {{"codec.bits", &CodecParameters::bits, 4, 24},
                            {"codec.components", &CodecParameters::components, 1, 4096},
                            {"codec.basis_bits", &CodecParameters::basis_bits, 2, 20},
                            {"codec.coefficient_bits", &CodecParameters::coefficient_bits, 2, 20},
                            {"codec.frame_bits", &CodecParameters::frame_bits, 4, 22},
                            {"codec.lpc_order", &CodecParameters::lpc_order, 1, 2}};
    for (const Range& range : ranges) {
        CodecParameters parameters;
        for (const std::int32_t good : {range.low, range.high}) {
            parameters.*range.member = good;
            EXPECT_TRUE(check_parameters(parameters).has_value()) << range.name << " " << good;
        }
        for (const std::int32_t bad : {range.low - 1, range.high + 1, -1, INT32_MAX, INT32_MIN}) {
            parameters.*range.member = bad;
            const auto checked = check_parameters(parameters);
            ASSERT_FALSE(checked.has_value()) << range.name << " " << bad;
            EXPECT_EQ(checked.error().code, ErrorCode::kInvalidArgument);
            EXPECT_NE(checked.error().message.find(range.name), std::string::npos) << checked.error().message;
        }
    }
}

TEST(Parameters, SegmentationRangeIsExact) {
    for (const std::int32_t good : {0, 1, 65535}) {
        EXPECT_TRUE(check_parameters(SegmentationParameters{.clusters = good}).has_value());
    }
    for (const std::int32_t bad : {65536, -1, INT32_MIN}) {
        const auto checked = check_parameters(SegmentationParameters{.clusters = bad});
        ASSERT_FALSE(checked.has_value()) << bad;
        EXPECT_NE(checked.error().message.find("segmentation.clusters"), std::string::npos);
    }
}

TEST(Parameters, ThresholdIsAPart) {
    for (const double good : {0.0, 1e-9, 1.0})
        EXPECT_TRUE(check_parameters(SegmentationParameters{.threshold = good}).has_value());
    for (const double bad : {-1e-9, 1.0001, std::numeric_limits<double>::quiet_NaN()}) {
        const auto checked = check_parameters(SegmentationParameters{.threshold = bad});
        ASSERT_FALSE(checked.has_value()) << bad;
        EXPECT_NE(checked.error().message.find("segmentation.threshold"), std::string::npos);
    }
}

TEST(Parameters, MethodsOfLaterVersionsAreUnsupported) {
    for (const int number : {7, 255}) {
        const auto checked = check_parameters(CodecParameters{.method = static_cast<CodecMethod>(number)});
        ASSERT_FALSE(checked.has_value()) << number;
        EXPECT_EQ(checked.error().code, ErrorCode::kUnsupported);
    }
    for (const int number : {0, 5, 255}) {
        const auto checked =
            check_parameters(SegmentationParameters{.method = static_cast<SegmentationMethod>(number)});
        ASSERT_FALSE(checked.has_value()) << number;
        EXPECT_EQ(checked.error().code, ErrorCode::kUnsupported);
    }
}

/// `parameters` with a target, and the method.
CodecParameters with(CodecMethod method, CodecTarget target, double value, CodecParameters parameters = {}) {
    parameters.method = method;
    switch (target) {
        case CodecTarget::kMaxError:
            parameters.max_error = value;
            break;
        case CodecTarget::kMaxErrorRelative:
            parameters.max_error_relative = value;
            break;
        case CodecTarget::kKg:
            parameters.target_kg = value;
            break;
        case CodecTarget::kDa:
            parameters.target_da = value;
            break;
        case CodecTarget::kBpvf:
            parameters.target_bpvf = value;
            break;
        case CodecTarget::kComponents:
            parameters.target_components = static_cast<std::int32_t>(value);
            break;
    }
    return parameters;
}

TEST(Parameters, WhatBaselinesAre) {
    for (int number = 0; number < 256; ++number) {
        const auto method = static_cast<CodecMethod>(number);
        if (!is_available(method)) continue;
        EXPECT_EQ(is_baseline(method), to_name(method).starts_with("baseline-")) << number;
    }
    using enum CodecMethod;
    for (const CodecMethod method :
         {kBaselineStatic, kBaselineLpc, kBaselineDynapack, kBaselineAngle, kBaselinePca, kBaselinePcaLpc,
          kBaselineCoddyac, kBaselineOctree, kBaselineWavelet})
        EXPECT_FALSE(uses_clusters(method)) << to_name(method);
    for (const CodecMethod method : {kBaselineCpca, kBaselineAffine})
        EXPECT_TRUE(uses_clusters(method)) << to_name(method);
    CodecParameters parameters{.method = kBaselineWavelet, .bits = 20};
    EXPECT_TRUE(check_parameters(parameters));
    parameters.bits = 21;
    EXPECT_FALSE(check_parameters(parameters));
    EXPECT_TRUE(has_predictor(kBaselineDynapack, GeometryPredictor::kReplica));
    EXPECT_FALSE(has_predictor(kBaselineDynapack, GeometryPredictor::kTime));
    EXPECT_FALSE(has_predictor(kBaselineLpc, GeometryPredictor::kLorenzo));
    EXPECT_TRUE(has_predictor(kBaselineLpc, GeometryPredictor::kAuto));
}

TEST(Parameters, TargetsBelongToMethods) {
    using enum CodecTarget;
    const std::pair<CodecMethod, std::vector<CodecTarget>> takers[] = {
        {CodecMethod::kStatic, {kMaxError, kMaxErrorRelative}},
        {CodecMethod::kSplitcoder, {kMaxError, kMaxErrorRelative}},
        {CodecMethod::kRlpca, {}},
        {CodecMethod::kOrlpca, {kKg, kDa, kBpvf, kComponents}},
        {CodecMethod::kPdct, {}},
        {CodecMethod::kRtpca, {kMaxError, kMaxErrorRelative, kKg, kDa, kBpvf}}};
    for (const auto& [method, targets] : takers) {
        for (const CodecTarget target : kCodecTargets) {
            const bool takes = std::find(targets.begin(), targets.end(), target) != targets.end();
            EXPECT_EQ(takes_target(method, target), takes) << to_name(method) << " " << to_name(target);
            const CodecParameters parameters = with(method, target, 2.0);
            EXPECT_EQ(value_of(parameters, target), 2.0);
            if (!is_available(method)) continue;
            EXPECT_EQ(check_parameters(parameters).has_value(), takes)
                << to_name(method) << " " << to_name(target);
        }
    }
}

TEST(Parameters, TargetsAreCountedAndPositive) {
    const auto code_of = [](const CodecParameters& parameters) {
        const auto checked = check_parameters(parameters);
        return checked ? ErrorCode{} : checked.error().code;
    };
    const CodecMethod method = CodecMethod::kOrlpca;
    EXPECT_EQ(code_of(CodecParameters{.method = method}), ErrorCode::kInvalidArgument) << "none at all";
    for (const CodecTarget target : {CodecTarget::kDa, CodecTarget::kBpvf, CodecTarget::kComponents}) {
        const CodecParameters kg = with(method, CodecTarget::kKg, 0.5);
        EXPECT_EQ(code_of(with(method, target, 1.0, kg)), ErrorCode::kInvalidArgument) << to_name(target);
        EXPECT_EQ(code_of(with(method, target, -1.0)), ErrorCode::kInvalidArgument) << to_name(target);
    }
    for (const double wrong :
         {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), -1e-300})
        EXPECT_EQ(code_of(with(method, CodecTarget::kKg, wrong)), ErrorCode::kInvalidArgument) << wrong;
}

TEST(Parameters, StepAndRateHaveRanges) {
    for (const double good : {1e-7, 2e-4, 1.0})
        EXPECT_TRUE(check_parameters(CodecParameters{.step = good}).has_value()) << good;
    for (const double bad : {0.0, 9e-8, 1.01, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
        const auto checked = check_parameters(CodecParameters{.step = bad});
        ASSERT_FALSE(checked.has_value()) << bad;
        EXPECT_EQ(checked.error().code, ErrorCode::kInvalidArgument);
        EXPECT_NE(checked.error().message.find("codec.step"), std::string::npos);
    }
    EXPECT_EQ(to_name(RateMeasure::kVectors), "vectors");
    EXPECT_EQ(to_name(RateMeasure::kBits), "bits");
    const auto checked = check_parameters(CodecParameters{.rate = static_cast<RateMeasure>(2)});
    ASSERT_FALSE(checked.has_value());
    EXPECT_EQ(checked.error().code, ErrorCode::kUnsupported);
}

TEST(Parameters, UnknownSpaceIsRefused) {
    const auto checked = check_parameters(CodecParameters{.space = static_cast<CoordinateSpace>(2)});
    ASSERT_FALSE(checked.has_value());
    EXPECT_EQ(checked.error().code, ErrorCode::kUnsupported);
}

}  // namespace
}  // namespace batchenc
