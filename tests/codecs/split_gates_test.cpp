#include "codecs/split_gates.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "kernels/bounding_box.h"
#include "kernels/split_prediction.h"
#include "tests/support/sample_clips.h"

namespace batchenc {
namespace {

using enum GeometryPredictor;
constexpr GeometryPredictor kPredictors[] = {
    kTime,    kSpace,           kSpaceMultiway, kSpaceTime,    kSpaceTimeMultiway,
    kLorenzo, kLorenzoMultiway, kReplica,       kLocalMultiway};
constexpr NormalPredictor kNormals[] = {NormalPredictor::kTime, NormalPredictor::kSpace,
                                        NormalPredictor::kSpaceTime};

SplitHeader header_of(const MeshSequence& clip, GeometryPredictor predictor, NormalPredictor normal,
                      double bound) {
    SplitHeader header;
    header.predictor = predictor;
    header.normal = normal;
    header.center = bounding_box(clip.view()).center();
    header.bound = bound;
    return header;
}

/// A clip whose first frame stands as in the source.
MeshSequence with_first_frame(const MeshSequence& clip) {
    MeshSequence other = clip;
    std::fill(other.positions.begin() + 3 * clip.vertex_count, other.positions.end(),
              std::numeric_limits<float>::quiet_NaN());
    return other;
}

struct Coded {
    MeshTopology mesh;
    SplitHeader header;
    MeshSequence decoded;
    SplitBits bits;  // before what adds to it
    std::vector<std::uint8_t> bytes;

    Coded(const MeshSequence& clip, GeometryPredictor predictor, NormalPredictor normal, double bound)
        : mesh(clip.triangles, clip.vertex_count),
          header(header_of(clip, predictor, normal, bound)),
          decoded(with_first_frame(clip)),
          bytes(encode_gates(clip.view(), mesh, header, decoded.view(), &bits)) {}

    Expected<MeshSequence> decode(std::span<const std::uint8_t> stream) const {
        MeshSequence other = with_first_frame(decoded);
        auto done = decode_gates(stream, mesh, header, other.view());
        if (!done) return tl::unexpected(done.error());
        return other;
    }
};

TEST(SplitGates, RoundTripsEveryKindOfClipAndMeetsItsBound) {
    for (const auto& [name, clip] : test::every_kind_of_clip()) {
        if (clip.frame_count < 2) continue;
        const double side = bounding_box(clip.view()).largest_side();
        for (const GeometryPredictor predictor : kPredictors) {
            for (const NormalPredictor normal : kNormals) {
                if (!splits(predictor) && normal != NormalPredictor::kTime) continue;
                for (const int bits : {4, 8, 12, 18}) {
                    const Coded coded(clip, predictor, normal, side * std::ldexp(1.0, -bits));
                    const auto what = name + ", " + std::string(to_name(predictor)) + ", " +
                                      std::string(to_name(normal)) + ", " + std::to_string(bits);
                    const auto decoded = coded.decode(coded.bytes);
                    ASSERT_TRUE(decoded) << what << ": " << decoded.error().to_string();
                    ASSERT_EQ(decoded->positions, coded.decoded.positions) << what;
                    ASSERT_LE(test::largest_distance(clip.view(), decoded->view()), coded.header.bound)
                        << what;
                }
            }
        }
    }
}

TEST(SplitGates, TinyBoundsAreKeptByCodingExactly) {
    const MeshSequence clip = test::sheet(6, 5, 3);
    for (const double bound : {1e-9, 1e-30, 1e-320}) {
        for (const GeometryPredictor predictor : {kTime, kLocalMultiway}) {
            const Coded coded(clip, predictor, NormalPredictor::kTime, bound);
            const auto decoded = coded.decode(coded.bytes);
            ASSERT_TRUE(decoded) << decoded.error().to_string();
            EXPECT_LE(test::largest_distance(clip.view(), decoded->view()), bound);
        }
    }
}

TEST(SplitGates, WhatDoesNotMoveCostsNextToNothing) {
    const MeshSequence clip = test::sheet(8, 8, 40, [](const std::array<double, 3>& p, double) { return p; });
    for (const GeometryPredictor predictor : {kTime, kLorenzo, kReplica, kLocalMultiway}) {
        const Coded coded(clip, predictor, NormalPredictor::kTime, 1e-3);
        EXPECT_LT(coded.bytes.size(), 64 * 39 / 16) << to_name(predictor);
    }
}

TEST(SplitGates, WhatMovesAsOneCostsLessByLocalCoordinates) {
    const MeshSequence clip = test::sheet(12, 12, 12, [](const std::array<double, 3>& p, double time) {
        const double c = std::cos(3.0 * time), s = std::sin(3.0 * time);
        return std::array<double, 3>{c * p[0] - s * p[2], p[1], s * p[0] + c * p[2]};
    });
    const auto size = [&](GeometryPredictor predictor) {
        return Coded(clip, predictor, NormalPredictor::kTime, 1e-3).bytes.size();
    };
    EXPECT_LT(size(kTime), size(kSpaceTime));
    EXPECT_LT(size(kSpaceTime), size(kSpace));
    EXPECT_LT(size(kLocalMultiway), size(kLorenzoMultiway));
    EXPECT_LT(size(kLocalMultiway), size(kTime));
}

TEST(SplitGates, PartsAddUpToTheStream) {
    const MeshSequence clip = test::sheet(16, 12, 20);
    for (const GeometryPredictor predictor : {kTime, kSpaceTimeMultiway, kLocalMultiway}) {
        const Coded coded(clip, predictor, NormalPredictor::kSpaceTime, 1e-4);
        EXPECT_GT(coded.bits.tangential, 0.0);
        EXPECT_GT(coded.bits.normal, 0.0);
        EXPECT_NEAR(coded.bits.tangential + coded.bits.normal, 8.0 * static_cast<double>(coded.bytes.size()),
                    300.0);
    }
}

// ---- hostile bytes ----

TEST(SplitGates, RefusesTruncationsFlippedBitsAndExtraBytes) {
    MeshSequence clip = test::sheet(6, 5, 4);
    clip.triangles.resize(clip.triangles.size() - 6);  // some vertices without a triangle
    for (const GeometryPredictor predictor : {kTime, kSpaceTimeMultiway, kReplica, kLocalMultiway}) {
        for (const double bound : {0.05, 1e-5}) {
            const Coded coded(clip, predictor, NormalPredictor::kSpaceTime, bound);
            for (std::size_t size = 0; size < coded.bytes.size(); ++size) {
                const auto decoded = coded.decode(std::span(coded.bytes).first(size));
                ASSERT_FALSE(decoded) << size;
                ASSERT_EQ(decoded.error().code, ErrorCode::kCorrupt);
            }
            auto bytes = coded.bytes;
            for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
                bytes[bit / 8] ^= static_cast<std::uint8_t>(1u << (bit % 8));
                // Another step may be another valid clip; a changed residual never is.
                const auto decoded = coded.decode(bytes);
                if (bit >= 8) {
                    ASSERT_FALSE(decoded) << "bit " << bit;
                }
                bytes[bit / 8] ^= static_cast<std::uint8_t>(1u << (bit % 8));
            }
            bytes.push_back(0);
            ASSERT_FALSE(coded.decode(bytes));
        }
    }
}

TEST(SplitGates, SurvivesAnyHeaderAndFirstFrame) {
    const MeshSequence clip = test::sheet(6, 5, 4);
    for (const GeometryPredictor predictor : kPredictors) {
        Coded coded(clip, predictor, NormalPredictor::kSpace, 1e-3);
        for (const double bound : {0.0, 1e-300, 1e300}) {
            coded.header.bound = bound;
            EXPECT_FALSE(coded.decode(coded.bytes));
        }
        coded.header.bound = 1e-3;
        coded.header.center = {3e38f, -3e38f, 3e38f};
        EXPECT_FALSE(coded.decode(coded.bytes));
        coded.header.center = {};
        std::fill_n(coded.decoded.positions.begin(), 90, 3e38f);
        EXPECT_FALSE(coded.decode(coded.bytes));
    }
}

}  // namespace
}  // namespace batchenc
