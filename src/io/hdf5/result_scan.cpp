#include "io/hdf5/result_scan.h"

#include <algorithm>
#include <optional>

#include "io/hdf5/result_layout.h"

namespace batchenc {

namespace {

using hdf5::Handle;
using hdf5::last_error;

/// The kind that a stored type is exactly, if any.
std::optional<ContentKind> kind_of(hid_t type) {
    if (H5Tget_class(type) == H5T_STRING) {
        if (H5Tis_variable_str(type) != 0) return {};
        return ContentKind::kString;
    }
    const std::pair<ContentKind, hid_t> kinds[] = {
        {ContentKind::kUint8, H5T_STD_U8LE},     {ContentKind::kInt32, H5T_STD_I32LE},
        {ContentKind::kInt64, H5T_STD_I64LE},    {ContentKind::kFloat32, H5T_IEEE_F32LE},
        {ContentKind::kFloat64, H5T_IEEE_F64LE},
    };
    for (const auto& [kind, standard] : kinds)
        if (H5Tequal(type, standard) > 0) return kind;
    return {};
}

tl::unexpected<Error> corrupt(const std::string& message, const std::string& where = {}) {
    return fail(ErrorCode::kCorrupt, message, where);
}

struct AttributeContent {
    ContentKind kind;
    std::string bytes;
};

Expected<AttributeContent> read_attribute(const hdf5::InputFile& input, hid_t object, const char* name) {
    const Handle attribute(H5Aopen(object, name, H5P_DEFAULT), H5Aclose);
    if (!attribute) return corrupt(last_error("opening an attribute"));
    const Handle type(H5Aget_type(attribute.get()), H5Tclose);
    const Handle space(H5Aget_space(attribute.get()), H5Sclose);
    const auto kind = type ? kind_of(type.get()) : std::nullopt;
    if (!kind) return corrupt("is of a type that results do not have");
    if (!space || H5Sget_simple_extent_type(space.get()) != H5S_SCALAR) return corrupt("is not a scalar");
    const std::size_t size = H5Tget_size(type.get());
    if (size == 0 || size > static_cast<std::size_t>(input.size_bytes))
        return corrupt("is larger than the file");
    AttributeContent content{*kind, std::string(size, '\0')};
    if (H5Aread(attribute.get(), type.get(), content.bytes.data()) < 0) return corrupt(last_error("reading"));
    return content;
}

struct CheckedDataset {
    ContentKind kind = ContentKind::kUint8;
    Handle type;
    std::int64_t extent = 0;
    std::int64_t size_bytes = 0;
};

Expected<CheckedDataset> check_dataset(const hdf5::InputFile& input, hid_t dataset) {
    CheckedDataset checked;
    checked.type = Handle(H5Dget_type(dataset), H5Tclose);
    const auto kind = checked.type ? kind_of(checked.type.get()) : std::nullopt;
    if (!kind || *kind == ContentKind::kString) return corrupt("is of a type that results do not have");
    checked.kind = *kind;
    const Handle properties(H5Dget_create_plist(dataset), H5Pclose);
    if (!properties || H5Pget_layout(properties.get()) != H5D_CONTIGUOUS ||
        H5Pget_nfilters(properties.get()) != 0 || H5Pget_external_count(properties.get()) != 0)
        return corrupt("is not stored contiguously in this file");
    const Handle space(H5Dget_space(dataset), H5Sclose);
    if (!space) return corrupt(last_error("reading the shape"));
    const auto shape = hdf5::shape_of(space.get());
    if (!shape || shape->size() != 1) return corrupt("is not one-dimensional");
    checked.extent = (*shape)[0];
    const auto value_bytes = static_cast<std::int64_t>(H5Tget_size(checked.type.get()));
    if (checked.extent < 1 || checked.extent > input.size_bytes / value_bytes)
        return corrupt("declares " + std::to_string(checked.extent) +
                       " values, which the file does not hold");
    checked.size_bytes = checked.extent * value_bytes;
    const haddr_t offset = H5Dget_offset(dataset);  // HADDR_UNDEF where nothing was ever stored
    if (offset == HADDR_UNDEF || offset > static_cast<haddr_t>(input.size_bytes - checked.size_bytes) ||
        H5Dget_storage_size(dataset) != static_cast<hsize_t>(checked.size_bytes))
        return corrupt("does not lie inside the file");
    return checked;
}

class Scanner {
 public:
    explicit Scanner(const hdf5::InputFile& input)
        : input_(input), bytes_left_(input.size_bytes), entries_left_(input.size_bytes) {}

    Expected<void> scan_group(hid_t group, const std::string& path, int depth) {
        constexpr int kDeepest = 8;
        if (depth > kDeepest) return corrupt("groups are nested too deeply", path);
        auto names = hdf5::link_names(group, static_cast<std::size_t>(input_.size_bytes));
        if (!names) return corrupt(names.error().message, path);
        for (const std::string& name : *names) {
            const std::string member = path == "/" ? path + name : path + "/" + name;
            if (auto scanned = scan_member(group, name, member, depth); !scanned) return scanned;
        }
        return {};
    }

    Expected<void> scan_attributes(hid_t object, const std::string& path) {
        const auto names = hdf5::attribute_names(object, static_cast<std::size_t>(input_.size_bytes));
        if (!names) return corrupt(names.error().message, path);
        for (const std::string& name : *names) {
            if (path == "/" && name == result_layout::kDigest) continue;
            const std::string key = ResultDigest::attribute_key(path, name);
            const auto content = read_attribute(input_, object, name.c_str());
            if (!content) return corrupt(content.error().message, key);
            if (auto spent = spend(static_cast<std::int64_t>(content->bytes.size())); !spent) return spent;
            ContentHash hash(content->kind);
            hash.update(content->bytes.data(), content->bytes.size());
            if (!digest_.add(key, hash)) return corrupt("appears twice", key);
        }
        return {};
    }

    ResultDigest take_digest() { return std::move(digest_); }

 private:
    /// However often things are linked to each other, a walk takes no more steps than the file has bytes.
    Expected<void> spend(std::int64_t bytes) {
        if (bytes > bytes_left_ || entries_left_ <= 0) return corrupt("declares more than the file holds");
        bytes_left_ -= bytes;
        --entries_left_;
        return {};
    }

    Expected<void> scan_member(hid_t group, const std::string& name, const std::string& path, int depth) {
        H5L_info_t link;
        if (H5Lget_info(group, name.c_str(), &link, H5P_DEFAULT) < 0 || link.type != H5L_TYPE_HARD)
            return corrupt("is not linked directly", path);
        const Handle object(H5Oopen(group, name.c_str(), H5P_DEFAULT), H5Oclose);
        if (!object) return corrupt(last_error("opening"), path);
        const H5I_type_t type = H5Iget_type(object.get());
        if (type != H5I_GROUP && type != H5I_DATASET)
            return corrupt("is neither a group nor a dataset", path);
        if (type == H5I_DATASET) {
            if (auto scanned = scan_dataset(object.get(), path); !scanned) return scanned;
        } else {
            if (auto spent = spend(0); !spent) return spent;
            if (!digest_.add(path, ContentHash(ContentKind::kGroup))) return corrupt("appears twice", path);
            if (auto scanned = scan_group(object.get(), path, depth + 1); !scanned) return scanned;
        }
        return scan_attributes(object.get(), path);
    }

    Expected<void> scan_dataset(hid_t dataset, const std::string& path) {
        const auto checked = check_dataset(input_, dataset);
        if (!checked) return corrupt(checked.error().message, path);
        if (auto spent = spend(checked->size_bytes); !spent) return spent;
        constexpr std::int64_t kRunBytes = 1 << 20;
        const std::int64_t value_bytes = checked->size_bytes / checked->extent;
        const std::int64_t run_values = std::min(kRunBytes / value_bytes, checked->extent);
        buffer_.resize(static_cast<std::size_t>(run_values * value_bytes));
        ContentHash hash(checked->kind, checked->extent);
        const Handle file_space(H5Dget_space(dataset), H5Sclose);
        for (std::int64_t begin = 0; begin < checked->extent; begin += run_values) {
            const auto start = static_cast<hsize_t>(begin);
            const auto count = static_cast<hsize_t>(std::min(run_values, checked->extent - begin));
            const Handle memory_space(H5Screate_simple(1, &count, nullptr), H5Sclose);
            if (!file_space || !memory_space ||
                H5Sselect_hyperslab(file_space.get(), H5S_SELECT_SET, &start, nullptr, &count, nullptr) < 0 ||
                H5Dread(dataset, checked->type.get(), memory_space.get(), file_space.get(), H5P_DEFAULT,
                        buffer_.data()) < 0)
                return corrupt(last_error("reading"), path);
            hash.update(buffer_.data(), count * static_cast<std::size_t>(value_bytes));
        }
        if (!digest_.add(path, hash)) return corrupt("appears twice", path);
        return {};
    }

    const hdf5::InputFile& input_;
    std::int64_t bytes_left_;
    std::int64_t entries_left_;
    std::vector<std::uint8_t> buffer_;
    ResultDigest digest_;
};

}  // namespace

Expected<ResultDigest> scan_result(const hdf5::InputFile& input) {
    const Handle root(H5Gopen2(input.file.get(), "/", H5P_DEFAULT), H5Gclose);
    if (!root) return corrupt(last_error("opening the root group"));
    Scanner scanner(input);
    if (auto scanned = scanner.scan_attributes(root.get(), "/"); !scanned)
        return tl::unexpected(scanned.error());
    if (auto scanned = scanner.scan_group(root.get(), "/", 0); !scanned)
        return tl::unexpected(scanned.error());
    return scanner.take_digest();
}

Expected<hdf5::Handle> open_result_dataset(const hdf5::InputFile& input, const std::string& path,
                                           ContentKind kind, std::int64_t& extent) {
    Handle dataset(H5Dopen2(input.file.get(), path.c_str(), H5P_DEFAULT), H5Dclose);
    if (!dataset) return corrupt(last_error("opening"), path);
    auto checked = check_dataset(input, dataset.get());
    if (!checked) return corrupt(checked.error().message, path);
    if (checked->kind != kind) return corrupt("is of another type than it has in a result", path);
    extent = checked->extent;
    return dataset;
}

Expected<std::string> read_result_attribute(const hdf5::InputFile& input, hid_t object, const char* name,
                                            ContentKind kind) {
    if (H5Aexists(object, name) <= 0) return corrupt(std::string("attribute ") + name + " is missing");
    auto content = read_attribute(input, object, name);
    if (!content) return corrupt(std::string("attribute ") + name + " " + content.error().message);
    if (content->kind != kind)
        return corrupt(std::string("attribute ") + name + " is of another type than it has in a result");
    return std::move(content->bytes);
}

}  // namespace batchenc
