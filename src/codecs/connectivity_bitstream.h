#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/error.h"
#include "core/mesh_sequence.h"

namespace batchenc {

/// The content of /connectivity/bitstream (docs/FORMAT.md): magic "BENM", version, coder, counts, coded
/// triangles, and a CRC32C over everything before it.
struct ConnectivityBitstream {
    std::vector<std::uint8_t> bytes;
    std::int64_t order_bytes = 0;  ///< of `bytes`, those spent on vertex and triangle order
};

/// Codes T triangles over `vertex_count` vertices. Errors as encode_connectivity.
Expected<ConnectivityBitstream> write_connectivity_bitstream(std::span<const Triangle> triangles,
                                                             std::int64_t vertex_count);

/// Triangles of a connectivity bitstream for `vertex_count` vertices. max_triangle_count: more are refused
/// before anything is allocated for them, because a few bytes can stand for many triangles. Errors: kFormat
/// (no such stream), kUnsupported (version, coder), kCorrupt (checksum, sizes, indices, another vertex
/// count), kOutOfMemory.
Expected<std::vector<Triangle>> read_connectivity_bitstream(std::span<const std::uint8_t> bytes,
                                                            std::int64_t vertex_count,
                                                            std::int64_t max_triangle_count);

}  // namespace batchenc
