#include "kernels/reconstruction.h"

#include <gtest/gtest.h>

#include <cmath>

#include "kernels/local_frame.h"

namespace batchenc {
namespace {

float wave(std::int64_t a, std::int64_t b) {
    return static_cast<float>(std::sin(1.3 * static_cast<double>(a) + 0.7 * static_cast<double>(b)));
}

/// A cluster of n vertices at the odd places of 2n + 1, with waves for values.
struct Sample {
    static constexpr std::int64_t kFrames = 21, kStride = 32;

    Sample(std::int64_t n, std::int64_t components)
        : vertex_count(2 * n + 1),
          basis(n, components),
          coefficients(static_cast<std::size_t>(components * kStride)),
          track(kFrames) {
        for (std::int64_t v = 0; v < n; ++v) vertices.push_back(static_cast<std::int32_t>(2 * v + 1));
        for (std::int64_t row = 0; row < 3 * n; ++row) {
            for (std::int64_t l = 0; l < components; ++l) basis.values[basis.index(row, l)] = wave(row, l);
        }
        for (std::size_t k = 0; k < coefficients.size(); ++k)
            coefficients[k] = wave(static_cast<std::int64_t>(k), 5);
        for (std::int64_t f = 0; f < kFrames; ++f) {
            const double a = 0.2 * static_cast<double>(f);
            track.set(f, local_frame({a, 0, 1}, {a + std::cos(a), std::sin(a), 1}, {a, 1, 2}, {}));
        }
    }

    /// Coordinate c of the k-th vertex of the cluster, in double precision.
    double expected(std::int64_t k, std::int64_t c, std::int64_t frame) const {
        double p = track.row(static_cast<int>(9 + c))[frame];
        for (std::int64_t axis = 0; axis < 3; ++axis) {
            double q = 0.0;
            for (std::int64_t l = 0; l < basis.component_count; ++l) {
                q += static_cast<double>(wave(3 * k + axis, l)) *
                     coefficients[static_cast<std::size_t>(l * kStride + frame)];
            }
            p += q * track.row(static_cast<int>(3 * axis + c))[frame];
        }
        return p;
    }

    std::int64_t vertex_count;
    std::vector<std::int32_t> vertices;
    PackedBasis basis;
    std::vector<float> coefficients;
    LocalFrameTrack track;
};

TEST(Reconstruction, AgreesWithTheProductInDoublePrecision) {
    for (const std::int64_t n : {1, 3, 4, 5, 17}) {
        for (const std::int64_t components : {0, 1, 7}) {
            const Sample sample(n, components);
            const ClusterGeometry cluster = {sample.vertices, &sample.basis, sample.coefficients.data(),
                                             sample.track.values.data(), Sample::kStride};
            for (const auto& [begin, count] :
                 {std::pair<std::int64_t, std::int64_t>{0, 8}, {8, 3}, {16, 5}, {8, 1}}) {
                std::vector<float> out(static_cast<std::size_t>(count * sample.vertex_count * 3), -99.0f);
                reconstruct_cluster(cluster, begin, count, out.data(), sample.vertex_count * 3);
                for (std::int64_t i = 0; i < static_cast<std::int64_t>(out.size()); ++i) {
                    const std::int64_t c = i % 3, v = i / 3 % sample.vertex_count,
                                       frame = begin + i / (3 * sample.vertex_count);
                    const double expected = v % 2 == 1 ? sample.expected(v / 2, c, frame)
                                                       : -99.0;  // others' vertices stay as they were
                    ASSERT_NEAR(out[static_cast<std::size_t>(i)], expected, 1e-5)
                        << "n " << n << " L " << components << " frame " << frame;
                }
            }
        }
    }
}

}  // namespace
}  // namespace batchenc
