#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <span>

#include "core/error.h"
#include "core/mesh_sequence.h"

namespace batchenc {

/// Red, green, blue, 0 … 255.
using Color = std::array<std::uint8_t, 3>;

/// Writes a mesh as binary little-endian PLY, which appears whole or not at all.
///
/// positions: one frame, V vertices. triangles: may be empty. colors: V values, or none.
/// Errors: kExists (overwrite not given), kIo.
Expected<void> write_ply(const std::filesystem::path& path, PositionsView positions,
                         std::span<const Triangle> triangles, std::span<const Color> colors, bool overwrite);

}  // namespace batchenc
