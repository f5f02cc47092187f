#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/error.h"
#include "core/mesh_sequence.h"

namespace batchenc {

/// Decodes triangles as results held them before surfaces were coded (coder 1 of docs/FORMAT.md): in file
/// order, each attached to an open edge of those before, or by indices. Nothing writes this any more.
///
/// triangle_count and vertex_count come from the enclosing header; triangle_count is checked against the size
/// of `bytes` before anything is allocated. Linear in time and memory. Errors: kCorrupt where the counts are
/// impossible, the bytes end early or are left over, or name an edge or vertex that does not exist;
/// kOutOfMemory.
Expected<std::vector<Triangle>> decode_attachments(std::span<const std::uint8_t> bytes,
                                                   std::int64_t triangle_count, std::int64_t vertex_count);

}  // namespace batchenc
