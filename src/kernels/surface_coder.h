#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/error.h"
#include "kernels/bit_coder.h"
#include "kernels/surface.h"

namespace batchenc {

/// A surface's triangles in the order of coding.
struct CodedSurface {
    /// Corners by vertex number (numbers in the order of their first coding, from 0), each wound as its
    /// source.
    std::vector<Triangle> triangles;
    /// Of encoding alone: number of each coded triangle in the surface, and index of each vertex number.
    std::vector<std::int32_t> source_triangle, source_vertex;
};

/// Codes a surface by region growing: every triangle beyond the first of its piece is placed across a gate of
/// the front, which says whether its third corner is new, and with it in how many triangles that corner
/// stands; where that number leaves no choice, nothing is coded (valences: C. Touma and C. Gotsman, "Triangle
/// mesh compression", 1998; gates at the vertices with fewest triangles left: P. Alliez and M. Desbrun,
/// "Valence-driven connectivity encoding for 3D meshes", 2001; the front as linked loops that split and join
/// alike: S. Gumhold and W. Strasser, "Real time compression of triangle mesh connectivity", 1998). Time and
/// memory are linear.
CodedSurface encode_surface(BitCoder& coder, const Surface& surface);

/// The way back. Memory grows with what is decoded. Errors: kCorrupt where the bits end early or name what
/// does not exist, and where more than vertex_count vertices appear.
Expected<CodedSurface> decode_surface(BitCoder& coder, std::int64_t triangle_count,
                                      std::int64_t vertex_count);

}  // namespace batchenc
