#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/error.h"
#include "core/mesh_sequence.h"
#include "kernels/bit_coder.h"
#include "kernels/surface_coder.h"

namespace batchenc {

/// Codes how a file orders what a surface coder gave in its own order: which triangle comes when and at which
/// corner it begins, and which vertex has which index. Files from authoring tools walk over the surface in
/// some way of their own: each next triangle is first asked for among the neighbours of the one before, then
/// on the front of those that have come, then among the rest; vertices the same way. Time is T log T.
///
/// coded: from encode_surface of the triangles. triangles: T, as in the file. vertex_count: indices are below
/// it.
void encode_order(BitCoder& coder, const CodedSurface& coded, std::span<const Triangle> triangles,
                  std::int64_t vertex_count);

/// The way back: the triangles as in the file. coded: of decode_surface, with V' vertex numbers in its
/// triangles. Errors: kCorrupt.
Expected<std::vector<Triangle>> decode_order(BitCoder& coder, const CodedSurface& coded,
                                             std::int64_t vertex_count);

}  // namespace batchenc
