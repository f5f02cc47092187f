#include <bit>
#include <charconv>
#include <cstring>
#include <fstream>
#include <new>
#include <string>

#include "io/hdf5/durable_file.h"
#include "io/mesh/mesh_formats.h"

namespace batchenc {

namespace {

static_assert(std::endian::native == std::endian::little,
              "binary values are written as they stand in memory");

template <typename Number>
void append_text(std::string& text, Number value) {
    char digits[32];
    text.append(digits, std::to_chars(digits, digits + sizeof(digits), value).ptr);
}

template <typename Value>
void append_binary(std::string& bytes, const Value& value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof(value));
}

void append_place(std::string& text, const float* p) {
    for (int axis = 0; axis < 3; ++axis) {
        if (axis > 0) text += ' ';
        append_text(text, p[axis]);
    }
    text += '\n';
}

std::string obj_of(PositionsView positions, std::span<const Triangle> triangles) {
    std::string text = "# batchenc\n";
    for (std::int64_t v = 0; v < positions.vertex_count(); ++v) {
        text += "v ";
        append_place(text, positions.at(0, v));
    }
    for (const Triangle& t : triangles) {
        text += 'f';
        for (const std::int32_t v : t) {
            text += ' ';
            append_text(text, std::int64_t{v} + 1);
        }
        text += '\n';
    }
    return text;
}

void append_face(std::string& text, const Triangle& t) {
    text += '3';
    for (const std::int32_t v : t) {
        text += ' ';
        append_text(text, v);
    }
    text += '\n';
}

std::string off_of(PositionsView positions, std::span<const Triangle> triangles) {
    std::string text =
        "OFF\n" + std::to_string(positions.vertex_count()) + " " + std::to_string(triangles.size()) + " 0\n";
    for (std::int64_t v = 0; v < positions.vertex_count(); ++v) append_place(text, positions.at(0, v));
    for (const Triangle& t : triangles) append_face(text, t);
    return text;
}

std::string ply_of(PositionsView positions, std::span<const Triangle> triangles,
                   std::span<const Color> colors, PlyEncoding encoding) {
    const bool is_text = encoding == PlyEncoding::kAscii;
    std::string bytes = std::string("ply\nformat ") + (is_text ? "ascii" : "binary_little_endian") +
                        " 1.0\ncomment batchenc\nelement vertex " + std::to_string(positions.vertex_count()) +
                        "\nproperty float x\nproperty float y\nproperty float z\n";
    if (!colors.empty()) bytes += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
    bytes += "element face " + std::to_string(triangles.size()) +
             "\nproperty list uchar int vertex_indices\nend_header\n";
    for (std::int64_t v = 0; v < positions.vertex_count(); ++v) {
        const Color* color = colors.empty() ? nullptr : &colors[static_cast<std::size_t>(v)];
        if (is_text) {
            append_place(bytes, positions.at(0, v));
            if (!color) continue;
            bytes.pop_back();  // the line goes on
            for (const std::uint8_t value : *color) (bytes += ' ').append(std::to_string(value));
            bytes += '\n';
        } else {
            for (int axis = 0; axis < 3; ++axis) append_binary(bytes, positions.at(0, v)[axis]);
            if (color) append_binary(bytes, *color);
        }
    }
    for (const Triangle& t : triangles) {
        if (is_text) {
            append_face(bytes, t);
        } else {
            append_binary(bytes, std::uint8_t{3});
            append_binary(bytes, t);
        }
    }
    return bytes;
}

}  // namespace

Expected<void> write_mesh(const std::filesystem::path& path, PositionsView positions,
                          std::span<const Triangle> triangles, std::span<const Color> colors, bool overwrite,
                          PlyEncoding encoding) {
    try {
        const auto format = mesh::format_of(path);
        if (!format)
            return fail(ErrorCode::kUnsupported, "is no .obj, .off or .ply; other formats are not written",
                        path.string());
        auto target = DurableFile::create(path, overwrite);
        if (!target) return tl::unexpected(target.error());
        const std::string bytes = *format == mesh::Format::kObj ? obj_of(positions, triangles)
                                  : *format == mesh::Format::kOff
                                      ? off_of(positions, triangles)
                                      : ply_of(positions, triangles, colors, encoding);
        std::ofstream file(target->temporary_path(), std::ios::binary);
        file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
        file.close();
        if (!file) return fail(ErrorCode::kIo, "cannot be written", path.string());
        return target->commit();
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::kOutOfMemory, "no memory to write the mesh", path.string());
    }
}

}  // namespace batchenc
