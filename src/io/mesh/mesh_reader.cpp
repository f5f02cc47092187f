#include <algorithm>
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

std::optional<Format> format_of(const std::filesystem::path& path) {
    std::string extension = path.extension().string();
    for (char& c : extension) {
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    }
    if (extension == ".obj") return Format::kObj;
    if (extension == ".off") return Format::kOff;
    if (extension == ".ply") return Format::kPly;
    return std::nullopt;
}

bool is_too_large(std::string_view word) {
    if (word.starts_with('-')) word.remove_prefix(1);
    const std::string_view digits = word.substr(0, word.find_first_of("eE"));
    const auto first = static_cast<std::int64_t>(digits.find_first_of("123456789"));
    const auto point = static_cast<std::int64_t>(std::min(digits.find('.'), digits.size()));
    if (first < 0) return false;
    // The first digit's power of ten. Out of range is what is far from 1, so that its sign is all that
    // counts.
    const std::int64_t power = first < point ? point - first - 1 : point - first;
    if (digits.size() == word.size()) return power > 0;
    std::string_view tail = word.substr(digits.size() + 1);
    if (tail.starts_with('+')) tail.remove_prefix(1);
    std::int64_t exponent = 0;
    if (std::from_chars(tail.data(), tail.data() + tail.size(), exponent).ec != std::errc())
        return !tail.starts_with('-');
    constexpr std::int64_t kFar = std::int64_t{1} << 60;  // farther than any file has digits
    return std::clamp(exponent, -kFar, kFar) + power > 0;
}

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
    if (vertex_count() >= limits_.max_vertices)
        return refuse(ErrorCode::kLimit, "more than " + std::to_string(limits_.max_vertices) + " vertices",
                      line);
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
    const std::int64_t face = face_count_++;
    for (const std::int64_t corner : corners) {
        if (corner < 0 || corner >= limits_.max_vertices)
            return refuse(ErrorCode::kOutOfRange,
                          "face " + std::to_string(face) + " names vertex " + std::to_string(corner) +
                              ", and there can be none",
                          line);
        if (corner > largest_corner_) {
            largest_corner_ = corner;
            largest_corner_face_ = face;
            largest_corner_line_ = line;
        }
    }
    if (corners.size() < 3) {
        ++mesh_.ignored_count;
        return {};
    }
    if (static_cast<std::int64_t>(mesh_.triangles.size() + corners.size()) - 2 > limits_.max_triangles)
        return refuse(ErrorCode::kLimit, "more than " + std::to_string(limits_.max_triangles) + " triangles",
                      line);
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
                      "face " + std::to_string(largest_corner_face_) + " names vertex " +
                          std::to_string(largest_corner_) + ", counted from 0, of " +
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
    const std::uintmax_t size = std::filesystem::file_size(path, error);
    if (!file || error) return fail(ErrorCode::kIo, "cannot be read", path.string());
    std::string bytes(static_cast<std::size_t>(size), '\0');
    if (!file.read(bytes.data(), static_cast<std::streamsize>(bytes.size())))
        return fail(ErrorCode::kIo, "cannot be read", path.string());
    return bytes;
}

}  // namespace

Expected<Mesh> read_mesh(const std::filesystem::path& path, const SourceLimits& limits) {
    try {
        const auto format = mesh::format_of(path);
        if (!format)
            return fail(ErrorCode::kUnsupported, "is no .obj, .off or .ply; other formats are not read",
                        path.string());
        const auto bytes = read_bytes(path);
        if (!bytes) return tl::unexpected(bytes.error());
        mesh::MeshBuilder builder(path.string(), limits);
        return *format == mesh::Format::kObj   ? mesh::read_obj(*bytes, builder)
               : *format == mesh::Format::kOff ? mesh::read_off(*bytes, builder)
                                               : mesh::read_ply(*bytes, builder);
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::kOutOfMemory, "no memory for the mesh", path.string());
    }
}

}  // namespace batchenc
