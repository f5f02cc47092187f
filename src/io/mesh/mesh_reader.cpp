#include <fstream>
#include <limits>
#include <new>

#include "io/mesh/mesh_formats.h"

namespace batchenc {

namespace mesh {

namespace {

bool is_space(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f'; }

std::string_view trimmed(std::string_view text) {
    while (!text.empty() && is_space(text.front())) text.remove_prefix(1);
    while (!text.empty() && is_space(text.back())) text.remove_suffix(1);
    return text;
}

}  // namespace

bool TextReader::next_line() {
    rest_ = {};
    while (at_ < text_.size()) {
        line_ += lines_ahead_;
        lines_ahead_ = 1;
        joined_.clear();
        bool goes_on = true;
        std::string_view line;
        while (goes_on && at_ < text_.size()) {
            const std::size_t end = std::min(text_.find('\n', at_), text_.size());
            line = text_.substr(at_, end - at_);
            at_ = std::min(end + 1, text_.size());
            line = trimmed(comment_ == '\0' ? line : line.substr(0, line.find(comment_)));
            goes_on = joins_ && line.ends_with('\\');
            if (!goes_on) break;
            line.remove_suffix(1);
            joined_.append(line).push_back(' ');
            line = {};
            ++lines_ahead_;
        }
        if (!joined_.empty()) {
            joined_.append(line);
            line = joined_;
        }
        rest_ = trimmed(line);
        if (!rest_.empty()) return true;
    }
    return false;
}

std::string_view TextReader::next_word() {
    std::size_t end = 0;
    while (end < rest_.size() && !is_space(rest_[end])) ++end;
    const std::string_view word = rest_.substr(0, end);
    rest_ = trimmed(rest_.substr(end));
    return word;
}

std::string_view TextReader::next_word_anywhere() {
    if (rest_.empty() && !next_line()) return {};
    return next_word();
}

Expected<void> MeshBuilder::add_vertex(const std::array<double, 3>& place, std::int64_t line) {
    if (vertex_count() == std::numeric_limits<std::int32_t>::max())
        return refuse(ErrorCode::kLimit, "more than 2^31 - 1 vertices", line);
    for (const double value : place) {
        const auto rounded = static_cast<float>(value);
        if (!std::isfinite(rounded))
            return refuse(
                ErrorCode::kNotFinite,
                "vertex " + std::to_string(vertex_count()) + " is not finite, or too large for float32",
                line);
        mesh_.positions.push_back(rounded);
    }
    return {};
}

Expected<void> MeshBuilder::add_face(std::span<const std::int64_t> corners, std::int64_t line) {
    for (const std::int64_t corner : corners) {
        if (corner < 0 || corner >= std::numeric_limits<std::int32_t>::max())
            return refuse(ErrorCode::kOutOfRange, "a corner of the face is no vertex", line);
        if (corner > largest_corner_) {
            largest_corner_ = corner;
            largest_corner_line_ = line;
        }
    }
    if (corners.size() < 3) {
        ++mesh_.ignored_count;
        return {};
    }
    mesh_.polygon_count += corners.size() > 3;
    for (std::size_t k = 2; k < corners.size(); ++k)
        mesh_.triangles.push_back({static_cast<std::int32_t>(corners[0]),
                                   static_cast<std::int32_t>(corners[k - 1]),
                                   static_cast<std::int32_t>(corners[k])});
    return {};
}

Expected<Mesh> MeshBuilder::finish() {
    if (vertex_count() == 0) return refuse(ErrorCode::kFormat, "has no vertices");
    if (largest_corner_ >= vertex_count())
        return refuse(ErrorCode::kOutOfRange,
                      "a face names vertex " + std::to_string(largest_corner_) + ", counted from 0, of " +
                          std::to_string(vertex_count()),
                      largest_corner_line_);
    return std::move(mesh_);
}

}  // namespace mesh

namespace {

Expected<std::string> read_bytes(const std::filesystem::path& path) {
    std::error_code error;
    if (!std::filesystem::is_regular_file(path, error))
        return fail(ErrorCode::kIo, error ? error.message() : "is no file", path.string());
    std::ifstream file(path, std::ios::binary);
    std::string bytes(static_cast<std::size_t>(std::filesystem::file_size(path, error)), '\0');
    if (!file || error || !file.read(bytes.data(), static_cast<std::streamsize>(bytes.size())))
        return fail(ErrorCode::kIo, "cannot be read", path.string());
    return bytes;
}

}  // namespace

Expected<Mesh> read_mesh(const std::filesystem::path& path) {
    try {
        const std::string extension = path.extension().string();
        const auto read = extension == ".obj"   ? mesh::read_obj
                          : extension == ".off" ? mesh::read_off
                          : extension == ".ply" ? mesh::read_ply
                                                : nullptr;
        if (!read)
            return fail(ErrorCode::kUnsupported, "is no .obj, .off or .ply; other formats are not read",
                        path.string());
        const auto bytes = read_bytes(path);
        if (!bytes) return tl::unexpected(bytes.error());
        return read(*bytes, path.string());
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::kOutOfMemory, "no memory for the mesh", path.string());
    }
}

}  // namespace batchenc
