#include "codecs/integer_contexts.h"

#include <gtest/gtest.h>

#include <cmath>

#include "codecs/coded_streams.h"
#include "codecs/rlpca_layout.h"
#include "tests/support/sample_clips.h"

namespace batchenc {
namespace {

TEST(IntegerContexts, SeriesRoundTrip) {
    std::vector<std::vector<std::int32_t>> all = {{}, {5}, {70000, 70001}, {1, -1, 1, -1, 1, -1}};
    all.emplace_back(300);
    for (int i = 0; i < 300; ++i)
        all.back()[static_cast<std::size_t>(i)] =
            static_cast<std::int32_t>(std::lround(40000.0 * std::sin(0.05 * i)));
    RangeEncoder encoder;
    SeriesContexts out;
    for (const auto& series : all) encode_series(encoder, out, series);
    const auto bytes = encoder.finish();
    EXPECT_LT(bytes.size(), 400u) << "a smooth series is predicted";
    auto decoder = RangeDecoder::open(bytes);
    ASSERT_TRUE(decoder);
    SeriesContexts in;
    for (const auto& series : all) {
        std::vector<std::int32_t> decoded(series.size());
        ASSERT_TRUE(decode_series(*decoder, in, decoded));
        EXPECT_EQ(decoded, series);
    }
    EXPECT_TRUE(decoder->finish());
}

TEST(IntegerContexts, ColumnsRoundTripAndSmoothOnesArePredicted) {
    const MeshSequence mesh = test::sheet(30, 30, 1);
    const std::vector<std::int32_t> labels(900, 0);
    const RlpcaLayout layout(labels, {}, 1, MeshAdjacency::of(mesh.triangles, 900), SerialExecutor());
    const ClusterTraversal& traversal = layout.clusters[0];
    std::vector<std::int32_t> smooth(2700), rough(2700);
    for (std::size_t k = 0; k < 900; ++k) {
        const int v = traversal.vertices[k];
        for (std::size_t c = 0; c < 3; ++c) {
            smooth[3 * k + c] = 20 * (v % 30) + 11 * (v / 30);
            rough[3 * k + c] = static_cast<std::int32_t>((k * 2654435761u + c * 40503u) % 601) - 300;
        }
    }
    std::size_t sizes[2];
    int run = 0;
    for (const auto* column : {&smooth, &rough}) {
        RangeEncoder encoder;
        ScaleContexts out;
        encode_column(encoder, out, traversal, *column);
        const auto bytes = encoder.finish();
        sizes[run++] = bytes.size();
        auto decoder = RangeDecoder::open(bytes);
        ASSERT_TRUE(decoder);
        ScaleContexts in;
        std::vector<std::int32_t> decoded;
        ASSERT_TRUE(decode_column(*decoder, in, traversal, decoded));
        decoded.resize(2700);
        EXPECT_EQ(decoded, *column);
        EXPECT_TRUE(decoder->finish());
    }
    EXPECT_LT(2 * sizes[0], sizes[1]);
}

TEST(IntegerContexts, ScaleClassesCoverEveryMagnitude) {
    EXPECT_EQ(ScaleContexts::class_of(0.0), 0);
    EXPECT_EQ(ScaleContexts::class_of(1.0), 8);
    EXPECT_EQ(ScaleContexts::class_of(2.0), 10);
    EXPECT_EQ(ScaleContexts::class_of(1e300), ScaleContexts::kClasses - 1);
    EXPECT_EQ(ScaleContexts::class_of(std::nan("")), 0);
}

TEST(DealStreams, CoversEachClusterOnceAndBalances) {
    std::vector<std::int64_t> values;
    for (int i = 0; i < 40; ++i) values.push_back(20000 + 977 * (i % 13));
    const auto streams = deal_streams(values);
    EXPECT_EQ(streams.size(), 16u);  // about a million values
    std::vector<int> seen(40, 0);
    std::int64_t least = 1 << 30, most = 0;
    for (const auto& stream : streams) {
        std::int64_t load = 0;
        for (const std::int32_t i : stream) {
            ++seen[static_cast<std::size_t>(i)];
            load += values[static_cast<std::size_t>(i)];
        }
        least = std::min(least, load);
        most = std::max(most, load);
    }
    EXPECT_EQ(seen, std::vector<int>(40, 1));
    EXPECT_LT(most, 2 * least);
    EXPECT_EQ(deal_streams(std::vector<std::int64_t>{0, 0, 0}).size(), 1u);
}

}  // namespace
}  // namespace batchenc
