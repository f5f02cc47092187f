#pragma once

#include <charconv>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <string_view>

#include "io/mesh/mesh_file.h"

/// What the readers and writers of the single formats share. Inside src/io/mesh only.
namespace batchenc::mesh {

enum class Format { kObj, kOff, kPly };

/// By the extension, in capitals or not; nothing where it is another.
std::optional<Format> format_of(const std::filesystem::path& path);

/// Words of a text, line after line.
class TextReader {
 public:
    /// comment: begins what is passed over to the end of a line; NUL: nothing does. joins: a backslash at a
    /// line's end joins it with the next.
    TextReader(std::string_view text, char comment, bool joins = false)
        : text_(text), comment_(comment), joins_(joins) {}

    /// Goes to the next line that has words; false at the end of the text.
    bool next_line();
    /// The next word of this line, empty when there is none.
    std::string_view next_word();
    /// The next word, on whatever line it stands; empty at the end of the text.
    std::string_view next_word_anywhere();

    std::int64_t line() const { return line_; }   ///< from 1
    std::size_t position() const { return at_; }  ///< of the byte after this line

 private:
    std::string_view text_;
    char comment_;
    bool joins_;
    std::size_t at_ = 0;
    std::int64_t line_ = 0, lines_ahead_ = 1;
    std::string joined_;
    std::string_view rest_;  // of the line, in the text or in joined_
};

/// Of a decimal number that std::from_chars finds out of range, whether it is too large; else it is too close
/// to zero.
bool is_too_large(std::string_view word);

/// A whole word as a number; nothing where it is none. To be asked for the type that is wanted in the end:
/// a decimal that is rounded to double first may end in the wrong float32.
template <typename Number>
std::optional<Number> parse_number(std::string_view word) {
    if (word.starts_with('+') && !word.starts_with("+-")) word.remove_prefix(1);
    Number value{};
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    const bool is_out_of_range = error == std::errc::result_out_of_range && end == word.data() + word.size();
    if constexpr (std::is_floating_point_v<Number>) {
        // Too large is as good as infinite, and refused as that; too small is rounded to zero.
        if (is_out_of_range)
            return std::copysign(is_too_large(word) ? std::numeric_limits<Number>::infinity() : Number{0},
                                 word.starts_with('-') ? Number{-1} : Number{1});
    }
    if (error != std::errc() || end != word.data() + word.size()) return std::nullopt;
    return value;
}

/// Collects a mesh and checks what comes in.
class MeshBuilder {
 public:
    MeshBuilder(std::string file, const SourceLimits& limits) : file_(std::move(file)), limits_(limits) {}

    /// An error about this place; line 0 is the file as a whole.
    tl::unexpected<Error> refuse(ErrorCode code, std::string message, std::int64_t line = 0) const {
        return fail(code, std::move(message), line > 0 ? file_ + ":" + std::to_string(line) : file_);
    }

    Expected<void> add_vertex(const std::array<double, 3>& place, std::int64_t line);
    /// corners: vertex indices from 0; that they exist is checked by finish(), because a file may name
    /// vertices that come later. Negative ones are refused here. Errors name the face, counted from 0.
    Expected<void> add_face(std::span<const std::int64_t> corners, std::int64_t line);
    std::int64_t vertex_count() const { return mesh_.vertex_count(); }
    Expected<Mesh> finish();

 private:
    std::string file_;
    SourceLimits limits_;
    Mesh mesh_;
    std::int64_t face_count_ = 0;
    std::int64_t largest_corner_ = -1, largest_corner_face_ = 0, largest_corner_line_ = 0;
};

/// The content of a file into a builder that has nothing yet.
Expected<Mesh> read_obj(std::string_view text, MeshBuilder& builder);
Expected<Mesh> read_off(std::string_view text, MeshBuilder& builder);
Expected<Mesh> read_ply(std::string_view bytes, MeshBuilder& builder);

}  // namespace batchenc::mesh
