#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/error.h"
#include "core/mesh_sequence.h"
#include "core/parameters.h"

namespace batchenc {

/// The content of /connectivity/bitstream (docs/FORMAT.md): magic "BENM", version, coder, counts, coded
/// triangles, and a CRC32C over everything before it.
struct ConnectivityBitstream {
    std::vector<std::uint8_t> bytes;
    std::int64_t order_bytes = 0;  ///< of `bytes`, those spent on vertex and triangle order

    // Of MeshOrder::kFree alone.
    std::vector<Triangle> triangles;            ///< T, as the stream gives them back
    std::vector<std::int32_t> source_vertices;  ///< V: which of the source's vertices each vertex is
};

/// Codes T triangles over `vertex_count` vertices. Any input is accepted: boundaries, non-manifold, repeated
/// and degenerate triangles of any winding, unused vertices, none at all. With kPreserve indices, corners and
/// triangles come back as they are; with kFree in the coder's order, vertices without a triangle last.
/// Errors: kOutOfRange naming the triangle and the index; kInvalidArgument (vertex_count outside 0 … 2^31-1);
/// kLimit (T above 2^31 / 3); kOutOfMemory.
Expected<ConnectivityBitstream> write_connectivity_bitstream(std::span<const Triangle> triangles,
                                                             std::int64_t vertex_count, MeshOrder order);

/// Triangles of a connectivity bitstream for `vertex_count` vertices. max_triangle_count: more are refused
/// before anything is allocated for them, because a few bytes can stand for many triangles. Errors: kFormat
/// (no such stream), kUnsupported (version, coder), kCorrupt (checksum, sizes, indices, another vertex
/// count), kOutOfMemory.
Expected<std::vector<Triangle>> read_connectivity_bitstream(std::span<const std::uint8_t> bytes,
                                                            std::int64_t vertex_count,
                                                            std::int64_t max_triangle_count);

}  // namespace batchenc
