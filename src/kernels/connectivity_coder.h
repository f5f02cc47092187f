#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/error.h"
#include "core/mesh_sequence.h"

namespace batchenc {

/// Triangles as entropy-coded bytes, without magic or checksum (codecs/connectivity_bitstream adds those).
struct EncodedConnectivity {
    std::vector<std::uint8_t> bytes;
    /// Of `bytes`, those spent on restoring vertex and triangle order alone. Always 0 here: triangles are
    /// coded in the order in which they stand, so nothing is permuted and nothing has to be put back.
    std::int64_t order_bytes = 0;
};

/// Codes triangles so that indices, their rotation inside each triangle, winding and triangle order come back
/// exactly. Any input is accepted: boundaries, non-manifold, repeated and degenerate triangles, unused
/// vertices, none at all.
///
/// triangles: T triangles, every index in [0, vertex_count). vertex_count: 0 … 2^31-1.
/// Time and memory are linear in T. Per triangle: how it is attached to a triangle before it, which of the
/// vertices at hand is its third, and where none is, the distance of an index from a guess; each an
/// adaptively coded symbol. Attachment to open edges goes back to S. Gumhold and W. Strasser, "Real time
/// compression of triangle mesh connectivity", 1998; here it follows the order of the file instead of
/// choosing its own. Errors: kOutOfRange naming the triangle and the index; kInvalidArgument (vertex_count);
/// kOutOfMemory.
Expected<EncodedConnectivity> encode_connectivity(std::span<const Triangle> triangles,
                                                  std::int64_t vertex_count);

/// The way back. triangle_count and vertex_count come from the enclosing header; triangle_count is checked
/// against the size of `bytes` before anything is allocated. Errors: kCorrupt where the counts are
/// impossible, the bytes end early or are left over, or name an edge or vertex that does not exist;
/// kOutOfMemory.
Expected<std::vector<Triangle>> decode_connectivity(std::span<const std::uint8_t> bytes,
                                                    std::int64_t triangle_count, std::int64_t vertex_count);

}  // namespace batchenc
