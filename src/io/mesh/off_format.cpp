#include "io/mesh/mesh_formats.h"

namespace batchenc::mesh {

Expected<Mesh> read_off(std::string_view text, MeshBuilder& builder) {
    TextReader reader(text, '#');
    const std::string_view magic = reader.next_word_anywhere();
    // Normals (N), colours (C) and texture coordinates (ST) stand behind a vertex' place.
    if (magic != "OFF" && magic != "COFF" && magic != "NOFF" && magic != "CNOFF" && magic != "STOFF")
        return builder.refuse(ErrorCode::kFormat, "does not begin with OFF", 1);
    std::int64_t counts[3];
    for (std::int64_t& count : counts) {
        const auto number = parse_number<std::int64_t>(reader.next_word_anywhere());
        if (!number || *number < 0)
            return builder.refuse(ErrorCode::kFormat, "wants the numbers of vertices, faces and edges",
                                  reader.line());
        count = *number;
    }
    // No count is believed: what is not there shows when it is to be read.
    for (std::int64_t v = 0; v < counts[0]; ++v) {
        std::array<double, 3> place;
        const bool has_line = reader.next_line();
        for (double& value : place) {
            const auto number = parse_number<float>(has_line ? reader.next_word() : std::string_view());
            if (!number)
                return builder.refuse(ErrorCode::kFormat,
                                      "vertex " + std::to_string(v) + " of " + std::to_string(counts[0]) +
                                          " wants three numbers",
                                      reader.line());
            value = *number;
        }
        if (auto added = builder.add_vertex(place, reader.line()); !added)
            return tl::unexpected(added.error());
    }
    std::vector<std::int64_t> corners;
    for (std::int64_t f = 0; f < counts[1]; ++f) {
        const auto refuse = [&] {
            return builder.refuse(ErrorCode::kFormat,
                                  "face " + std::to_string(f) + " of " + std::to_string(counts[1]) +
                                      " wants a count and as many corners",
                                  reader.line());
        };
        if (!reader.next_line()) return refuse();
        const auto size = parse_number<std::int64_t>(reader.next_word());
        if (!size || *size < 0) return refuse();
        corners.clear();
        for (std::int64_t k = 0; k < *size; ++k) {
            const auto corner = parse_number<std::int64_t>(reader.next_word());
            if (!corner) return refuse();
            corners.push_back(*corner);
        }
        if (auto added = builder.add_face(corners, reader.line()); !added)
            return tl::unexpected(added.error());
    }
    return builder.finish();
}

}  // namespace batchenc::mesh
