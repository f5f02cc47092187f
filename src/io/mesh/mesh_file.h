#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include "core/error.h"
#include "core/mesh_sequence.h"
#include "io/source_clip.h"

namespace batchenc {

/// A static mesh as a file has it.
struct Mesh {
    std::vector<float> positions;  ///< [V][3], in the order of the file, those without a face included
    std::vector<Triangle>
        triangles;  ///< faces in the order of the file; larger ones as fans from their first corner
    std::int64_t polygon_count = 0;  ///< faces of more than three corners
    std::int64_t ignored_count = 0;  ///< faces of fewer than three: points and lines

    std::int64_t vertex_count() const { return static_cast<std::int64_t>(positions.size() / 3); }
};

/// Reads a mesh by the extension of its file, in capitals or not: .obj (Wavefront), .off, .ply (ascii and
/// both binary orders). Normals, texture coordinates, colours, groups and materials are passed over.
/// Coordinates become the nearest float32.
///
/// limits: what a source clip may have, so that whatever is read can stand in one.
///
/// Errors, with "file:line" as `where`, or "file" and the number of the vertex or face in the message: kIo
/// (cannot read), kUnsupported (another extension), kFormat (syntax, an early end, counts that the file
/// cannot hold), kOutOfRange (a corner that is no vertex), kNotFinite (NaN, Inf, or too large for float32),
/// kLimit (more vertices or triangles), kOutOfMemory.
Expected<Mesh> read_mesh(const std::filesystem::path& path, const SourceLimits& limits = {});

/// Red, green, blue, 0 … 255.
using Color = std::array<std::uint8_t, 3>;

/// How the body of a .ply is written.
enum class PlyEncoding { kBinary, kAscii };  ///< binary is little-endian

/// Writes a mesh by the extension of its file, in capitals or not: .obj, .off, .ply. Text has the shortest
/// digits that read back as the same float32. The file appears whole or not at all.
///
/// positions: one frame, V vertices. triangles: may be empty. colors: V values, or none; in .ply alone.
/// encoding: of .ply alone; the others are text.
/// Errors: kUnsupported (another extension), kExists (overwrite not given), kIo, kOutOfMemory.
Expected<void> write_mesh(const std::filesystem::path& path, PositionsView positions,
                          std::span<const Triangle> triangles, std::span<const Color> colors, bool overwrite,
                          PlyEncoding encoding = PlyEncoding::kBinary);

}  // namespace batchenc
