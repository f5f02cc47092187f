#include "core/parameters.h"

#include <gtest/gtest.h>

#include <limits>

#include <string>

namespace batchenc {
namespace {

TEST(Parameters, DefaultsAreAccepted) {
    EXPECT_TRUE(check_parameters(SegmentationParameters{}).has_value());
    EXPECT_TRUE(check_parameters(CodecParameters{}).has_value());
}

TEST(Parameters, NumbersAndNamesArePinned) {
    // The numbers stand in bitstreams, the names in job files.
    const std::pair<int, const char*> codecs[] = {{1, "static"}, {2, "splitcoder"}, {3, "rlpca"},
                                                  {4, "orlpca"}, {5, "pdct"},       {6, "rtpca"}};
    for (const auto& [number, name] : codecs) EXPECT_EQ(to_name(static_cast<CodecMethod>(number)), name);
    const std::pair<int, const char*> segmentations[] = {
        {1, "region-growing"}, {2, "clustering"}, {3, "adaptive"}, {4, "rigid"}};
    for (const auto& [number, name] : segmentations) {
        EXPECT_EQ(to_name(static_cast<SegmentationMethod>(number)), name);
    }
    EXPECT_EQ(to_name(static_cast<CoordinateSpace>(0)), "local");
    EXPECT_EQ(to_name(static_cast<CoordinateSpace>(1)), "world");
    EXPECT_EQ(to_name(static_cast<CodecMethod>(0)), "unknown");
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
                            {"codec.frame_bits", &CodecParameters::frame_bits, 4, 22}};
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
    for (const int number : {0, 4, 6, 7, 255}) {
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

TEST(Parameters, UnknownSpaceIsRefused) {
    const auto checked = check_parameters(CodecParameters{.space = static_cast<CoordinateSpace>(2)});
    ASSERT_FALSE(checked.has_value());
    EXPECT_EQ(checked.error().code, ErrorCode::kUnsupported);
}

}  // namespace
}  // namespace batchenc
