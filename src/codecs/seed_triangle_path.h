#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/error.h"
#include "core/executor.h"
#include "core/mesh_sequence.h"
#include "kernels/local_frame.h"

namespace batchenc {

/// The lattice that the corners of seed triangles are coded on.
struct FrameLattice {
    std::array<float, 3>
        center{};           ///< of the bounding box over all frames, world units; a point of the lattice
    float e_max = 0.0f;     ///< largest side of that box
    std::int32_t bits = 0;  ///< 4 … 22

    /// Spacing, world units.
    double step() const { return static_cast<double>(e_max) / static_cast<double>(std::int64_t{1} << bits); }
};

/// Seed triangles of one cluster over time on the lattice: nine series of F values, p1 and the edges p2 - p1,
/// p3 - p1.
struct SeedTrianglePath {
    std::array<std::vector<std::int32_t>, 9> series;

    /// Of a triangle of vertices, every coordinate rounded to the lattice.
    static SeedTrianglePath of(PositionsView positions, const Triangle& triangle,
                               const FrameLattice& lattice);

    /// World position of corner 0, 1 or 2 in a frame.
    std::array<double, 3> corner(std::size_t corner, std::int64_t frame, const FrameLattice& lattice) const;
    /// LCFs of all frames; corners are taken on the lattice, where a triangle without area is exactly that.
    LocalFrameTrack track(const FrameLattice& lattice) const;
};

/// The corners of all seed triangles in frames [begin, begin + out.frame_count()), to the vertices' places;
/// of several with a common vertex the first triangle's counts.
void write_corners(const std::vector<SeedTrianglePath>& paths, std::span<const Triangle> seed_triangles,
                   const FrameLattice& lattice, std::int64_t begin, MutablePositionsView out);

/// The section of LCFs: the paths of all clusters, along time.
std::vector<std::uint8_t> write_paths(const std::vector<SeedTrianglePath>& paths, std::int64_t frame_count,
                                      const Executor& executor);
/// The way back. path_count: at least 1. Error: kCorrupt.
Expected<std::vector<SeedTrianglePath>> read_paths(std::span<const std::uint8_t> payload,
                                                   std::size_t path_count, std::int64_t frame_count,
                                                   std::int32_t frame_bits, const Executor& executor);

}  // namespace batchenc
