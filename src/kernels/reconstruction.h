#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/mesh_sequence.h"

namespace batchenc {

/// Frames that the reconstruction kernel makes at once, one a SIMD lane.
inline constexpr std::int64_t kFrameLanes = 8;

/// Rows of a basis that stand together in a PackedBasis: the three coordinates of four vertices.
inline constexpr std::int64_t kPackedRows = 12;

/// A basis (3n × L) in the order in which the kernel reads it: blocks of four vertices, in each component by
/// component the twelve values of the block. The last block is filled up with zeros.
struct PackedBasis {
    std::int64_t vertex_count = 0;     ///< n
    std::int64_t component_count = 0;  ///< L
    std::vector<float> values;

    PackedBasis() = default;
    PackedBasis(std::int64_t vertices, std::int64_t components);
    /// Place of row (3 × vertex + coordinate) and component.
    std::size_t index(std::int64_t row, std::int64_t component) const {
        return static_cast<std::size_t>((row / kPackedRows * component_count + component) * kPackedRows +
                                        row % kPackedRows);
    }
};

/// One cluster as the kernel needs it.
struct ClusterGeometry {
    std::span<const std::int32_t> vertices;  ///< n vertex indices
    const PackedBasis* basis = nullptr;
    const float* coefficients =
        nullptr;  ///< L rows of `stride` floats; readable up to F rounded up to kFrameLanes
    const float* frame_track = nullptr;  ///< 12 rows of `stride` floats as in LocalFrameTrack
    std::int64_t stride = 0;
};

/// Reconstructs frames [begin, begin + count) of one cluster: p = Tᵀ (basis × coefficients) + o, scattered to
/// the vertices' places. begin: a multiple of kFrameLanes. count: 1 … kFrameLanes. out: frame `begin` of V ×
/// 3 floats, further frames `frame_stride` floats apart.
/// SIMD with run-time dispatch. Products are not fused and sums run in the order of the components, so that
/// every CPU gives the same bits: what an encoder has verified is what every decoder shows.
void reconstruct_cluster(const ClusterGeometry& cluster, std::int64_t begin, std::int64_t count, float* out,
                         std::int64_t frame_stride);

}  // namespace batchenc
