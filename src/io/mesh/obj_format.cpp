#include "io/mesh/mesh_formats.h"

namespace batchenc::mesh {

Expected<Mesh> read_obj(std::string_view text, MeshBuilder& builder) {
    TextReader reader(text, '#', true);
    std::vector<std::int64_t> corners;
    while (reader.next_line()) {
        const std::string_view keyword = reader.next_word();
        if (keyword == "v") {
            std::array<double, 3> place;
            for (double& value : place) {
                const auto number = parse_number<float>(reader.next_word());
                if (!number)
                    return builder.refuse(ErrorCode::kFormat, "a vertex wants three numbers", reader.line());
                value = *number;
            }
            if (auto added = builder.add_vertex(place, reader.line()); !added)
                return tl::unexpected(added.error());
        } else if (keyword == "f") {
            corners.clear();
            for (auto word = reader.next_word(); !word.empty(); word = reader.next_word()) {
                // v, v/vt, v//vn or v/vt/vn; negative numbers count back from the last vertex so far.
                const auto number = parse_number<std::int64_t>(word.substr(0, word.find('/')));
                if (!number || *number == 0)
                    return builder.refuse(ErrorCode::kFormat,
                                          "'" + std::string(word.substr(0, 40)) + "' is no corner of a face",
                                          reader.line());
                if (*number < -builder.vertex_count())
                    return builder.refuse(ErrorCode::kOutOfRange,
                                          "a corner counts back before the first vertex", reader.line());
                corners.push_back(*number > 0 ? *number - 1 : builder.vertex_count() + *number);
            }
            if (auto added = builder.add_face(corners, reader.line()); !added)
                return tl::unexpected(added.error());
        }
    }
    return builder.finish();
}

}  // namespace batchenc::mesh
