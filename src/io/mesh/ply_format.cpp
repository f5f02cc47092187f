#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>

#include "io/mesh/mesh_formats.h"

namespace batchenc::mesh {

namespace {

enum class Scalar { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat32, kFloat64 };

std::optional<Scalar> scalar_of(std::string_view name) {
    static constexpr std::pair<std::string_view, Scalar> kNames[] = {
        {"char", Scalar::kInt8},      {"int8", Scalar::kInt8},       {"uchar", Scalar::kUint8},
        {"uint8", Scalar::kUint8},    {"short", Scalar::kInt16},     {"int16", Scalar::kInt16},
        {"ushort", Scalar::kUint16},  {"uint16", Scalar::kUint16},   {"int", Scalar::kInt32},
        {"int32", Scalar::kInt32},    {"uint", Scalar::kUint32},     {"uint32", Scalar::kUint32},
        {"float", Scalar::kFloat32},  {"float32", Scalar::kFloat32}, {"double", Scalar::kFloat64},
        {"float64", Scalar::kFloat64}};
    for (const auto& [word, scalar] : kNames) {
        if (word == name) return scalar;
    }
    return std::nullopt;
}

struct Property {
    std::string name;
    Scalar type = Scalar::kFloat32;
    std::optional<Scalar> count_type;  // of a list
};

struct Element {
    std::string name;
    std::int64_t count = 0;
    std::vector<Property> properties;
};

/// Values of the body one after another, whatever they are coded in; nothing where the file ends or a word is
/// no number.
class Body {
 public:
    Body(std::string_view bytes, bool is_text, bool is_big_endian)
        : bytes_(bytes), text_(bytes, '\0'), is_text_(is_text), is_big_endian_(is_big_endian) {}

    std::optional<double> next(Scalar type) {
        if (is_text_) {
            const std::string_view word = text_.next_word_anywhere();
            if (type == Scalar::kFloat32) return parse_number<float>(word);
            return parse_number<double>(word);
        }
        switch (type) {
            case Scalar::kInt8:
                return take<std::int8_t>();
            case Scalar::kUint8:
                return take<std::uint8_t>();
            case Scalar::kInt16:
                return take<std::int16_t>();
            case Scalar::kUint16:
                return take<std::uint16_t>();
            case Scalar::kInt32:
                return take<std::int32_t>();
            case Scalar::kUint32:
                return take<std::uint32_t>();
            case Scalar::kFloat32:
                return take<float>();
            case Scalar::kFloat64:
                return take<double>();
        }
        return std::nullopt;
    }

 private:
    template <typename Value>
    std::optional<double> take() {
        if (bytes_.size() - at_ < sizeof(Value)) return std::nullopt;
        std::array<char, sizeof(Value)> raw;
        std::memcpy(raw.data(), bytes_.data() + at_, sizeof(Value));
        at_ += sizeof(Value);
        if (is_big_endian_ != (std::endian::native == std::endian::big)) std::reverse(raw.begin(), raw.end());
        return static_cast<double>(std::bit_cast<Value>(raw));
    }

    std::string_view bytes_;
    TextReader text_;
    bool is_text_, is_big_endian_;
    std::size_t at_ = 0;
};

struct Header {
    bool is_text = false, is_big_endian = false;
    std::vector<Element> elements;
    std::size_t size_bytes = 0;
};

Expected<Header> read_header(std::string_view bytes, const MeshBuilder& builder) {
    Header header;
    TextReader reader(bytes, '\0');
    const auto refuse = [&](const char* message) {
        return builder.refuse(ErrorCode::kFormat, message, reader.line());
    };
    if (!reader.next_line() || reader.next_word() != "ply") return refuse("does not begin with ply");
    bool has_format = false;
    while (reader.next_line()) {
        const std::string_view keyword = reader.next_word();
        if (keyword == "end_header") {
            if (!has_format) return refuse("states no format");
            header.size_bytes = reader.position();
            return header;
        }
        if (keyword == "format") {
            const std::string_view format = reader.next_word();
            header.is_text = format == "ascii";
            header.is_big_endian = format == "binary_big_endian";
            if (!header.is_text && !header.is_big_endian && format != "binary_little_endian")
                return refuse("is of an unknown format");
            has_format = true;
        } else if (keyword == "element") {
            Element element;
            element.name = reader.next_word();
            const auto count = parse_number<std::int64_t>(reader.next_word());
            if (!count || *count < 0) return refuse("an element wants a name and a count");
            element.count = *count;
            header.elements.push_back(std::move(element));
        } else if (keyword == "property") {
            if (header.elements.empty()) return refuse("a property of no element");
            Property property;
            std::string_view type = reader.next_word();
            if (type == "list") {
                property.count_type = scalar_of(reader.next_word());
                if (!property.count_type) return refuse("a list of an unknown type");
                type = reader.next_word();
            }
            const auto scalar = scalar_of(type);
            if (!scalar) return refuse("a property of an unknown type");
            property.type = *scalar;
            property.name = reader.next_word();
            header.elements.back().properties.push_back(std::move(property));
        }
    }
    return refuse("the header does not end");
}

/// A count or index that came as a number; nothing where it is no whole number of at most 2^32 in magnitude.
std::optional<std::int64_t> whole(std::optional<double> value) {
    if (!value || !(*value >= -4294967296.0 && *value <= 4294967296.0)) return std::nullopt;
    const auto number = static_cast<std::int64_t>(*value);
    return static_cast<double>(number) == *value ? std::optional(number) : std::nullopt;
}

/// What a property is to a mesh.
enum class Role { kX, kY, kZ, kCorners, kNone };

Role role_of(const Element& element, const Property& property) {
    const std::string& name = property.name;
    if (element.name == "vertex" && !property.count_type)
        return name == "x" ? Role::kX : name == "y" ? Role::kY : name == "z" ? Role::kZ : Role::kNone;
    if (element.name == "face" && property.count_type && (name == "vertex_indices" || name == "vertex_index"))
        return Role::kCorners;
    return Role::kNone;
}

/// That vertices and faces come once each, with what a mesh needs of them named once: a second one could
/// only be guessed at.
Expected<void> check_elements(const Header& header, const MeshBuilder& builder) {
    int vertex_elements = 0, face_elements = 0;
    for (const Element& element : header.elements) {
        const auto count = [&](Role role) {
            return std::ranges::count_if(element.properties,
                                         [&](const Property& p) { return role_of(element, p) == role; });
        };
        if (element.name == "vertex") {
            ++vertex_elements;
            if (count(Role::kX) != 1 || count(Role::kY) != 1 || count(Role::kZ) != 1)
                return builder.refuse(ErrorCode::kFormat, "its vertices want one x, one y and one z");
        } else if (element.name == "face") {
            ++face_elements;
            if (element.count > 0 && count(Role::kCorners) != 1)
                return builder.refuse(ErrorCode::kFormat,
                                      "its faces want one list vertex_indices or vertex_index");
        }
    }
    if (vertex_elements > 1 || face_elements > 1)
        return builder.refuse(ErrorCode::kFormat, "has two elements of one name");
    return {};
}

Expected<void> read_element(const Element& element, Body& body, MeshBuilder& builder) {
    const bool is_vertex = element.name == "vertex", is_face = element.name == "face";
    // An element without properties has no bytes: whatever its count is, there is nothing to walk over.
    if (element.properties.empty()) return {};
    std::vector<Role> roles;
    for (const Property& property : element.properties) roles.push_back(role_of(element, property));
    std::vector<std::int64_t> corners;
    for (std::int64_t k = 0; k < element.count; ++k) {
        const auto refuse = [&](const char* what) {
            return builder.refuse(ErrorCode::kFormat, element.name + " " + std::to_string(k) + " of " +
                                                          std::to_string(element.count) + ": " + what);
        };
        std::array<double, 3> place{};
        corners.clear();
        for (std::size_t p = 0; p < roles.size(); ++p) {
            const Property& property = element.properties[p];
            if (!property.count_type) {
                const auto value = body.next(property.type);
                if (!value) return refuse("the file ends, or a word is no number");
                if (roles[p] != Role::kNone) place[static_cast<std::size_t>(roles[p])] = *value;
                continue;
            }
            const auto size = whole(body.next(*property.count_type));
            if (!size || *size < 0) return refuse("a list of no size");
            for (std::int64_t i = 0; i < *size; ++i) {
                const auto value = body.next(property.type);
                if (!value) return refuse("the file ends inside a list, or a word is no number");
                if (roles[p] != Role::kCorners) continue;
                const auto corner = whole(value);
                if (!corner) return refuse("a corner is no whole number");
                corners.push_back(*corner);
            }
        }
        if (is_vertex) {
            if (auto added = builder.add_vertex(place, 0); !added) return added;
        } else if (is_face) {
            if (auto added = builder.add_face(corners, 0); !added) return added;
        }
    }
    return {};
}

}  // namespace

Expected<Mesh> read_ply(std::string_view bytes, MeshBuilder& builder) {
    const auto header = read_header(bytes, builder);
    if (!header) return tl::unexpected(header.error());
    if (auto checked = check_elements(*header, builder); !checked) return tl::unexpected(checked.error());
    Body body(bytes.substr(header->size_bytes), header->is_text, header->is_big_endian);
    for (const Element& element : header->elements) {
        if (auto read = read_element(element, body, builder); !read) return tl::unexpected(read.error());
    }
    return builder.finish();
}

}  // namespace batchenc::mesh
