#include "io/hdf5/source_dataset.h"

#include <algorithm>
#include <bit>
#include <limits>

namespace batchenc::hdf5 {

namespace {

/// Deflate cannot expand one byte to more than this many (258 bytes from two bits, RFC 1951).
constexpr std::int64_t kMaxDeflateRatio = 1032;

/// Whether an object stands at `name`, and only hard links lead to it.
Expected<bool> reaches_by_hard_links(hid_t file, const std::string& name, const std::string& where) {
    for (std::size_t end = 0; end < name.size();) {
        const std::size_t begin = name.find_first_not_of('/', end);
        if (begin == std::string::npos) return false;
        end = std::min(name.find('/', begin), name.size());
        const std::string prefix = name.substr(0, end);
        const htri_t exists = H5Lexists(file, prefix.c_str(), H5P_DEFAULT);
        if (exists < 0) return fail(ErrorCode::kCorrupt, last_error("looking up " + prefix), where);
        if (exists == 0) return false;
        H5L_info_t link;
        if (H5Lget_info(file, prefix.c_str(), &link, H5P_DEFAULT) < 0)
            return fail(ErrorCode::kCorrupt, last_error("looking up " + prefix), where);
        if (link.type != H5L_TYPE_HARD) {
            const char* kind = link.type == H5L_TYPE_SOFT       ? "a soft link"
                               : link.type == H5L_TYPE_EXTERNAL ? "an external link"
                                                                : "a user-defined link";
            return fail(ErrorCode::kUnsupported, prefix + " is " + kind + "; only data in place is read",
                        where);
        }
        H5O_info_t object;
        if (H5Oget_info_by_name(file, prefix.c_str(), &object, H5P_DEFAULT) < 0)
            return fail(ErrorCode::kCorrupt, last_error("looking at " + prefix), where);
        const bool last = name.find_first_not_of('/', end) == std::string::npos;
        if (object.type != (last ? H5O_TYPE_DATASET : H5O_TYPE_GROUP))
            return fail(ErrorCode::kFormat, prefix + (last ? " is not a dataset" : " is not a group"), where);
        if (last) return true;
    }
    return false;
}

/// a × b, or nothing where int64 cannot hold it; both at least 0.
std::optional<std::int64_t> checked_product(std::int64_t a, std::int64_t b) {
    std::int64_t product = 0;
    if (__builtin_mul_overflow(a, b, &product)) return {};
    return product;
}

Expected<void> check_type(SourceDataset& dataset, ValueKind kind) {
    const Handle type(H5Dget_type(dataset.handle.get()), H5Tclose);
    if (!type) return fail(ErrorCode::kCorrupt, last_error("reading the type"), dataset.where);
    const auto is_any_of = [&](std::initializer_list<hid_t> standard) {
        return std::any_of(standard.begin(), standard.end(),
                           [&](hid_t other) { return H5Tequal(type.get(), other) > 0; });
    };
    if (kind == ValueKind::kFloat) {
        if (!is_any_of({H5T_IEEE_F32LE, H5T_IEEE_F32BE, H5T_IEEE_F64LE, H5T_IEEE_F64BE}))
            return fail(ErrorCode::kFormat, "is neither float32 nor float64", dataset.where);
    } else if (!is_any_of({H5T_STD_I32LE, H5T_STD_I32BE, H5T_STD_I64LE, H5T_STD_I64BE})) {
        return fail(ErrorCode::kFormat, "is neither int32 nor int64", dataset.where);
    }
    dataset.value_bytes = H5Tget_size(type.get());
    if (std::endian::native == std::endian::little && H5Tget_order(type.get()) == H5T_ORDER_LE)
        dataset.packing.emplace();  // withdrawn below where the filters do not allow it
    return {};
}

Expected<void> check_filters(SourceDataset& dataset, hid_t properties) {
    const int count = H5Pget_nfilters(properties);
    if (count < 0) return fail(ErrorCode::kCorrupt, last_error("reading the filters"), dataset.where);
    ChunkPacking packing;
    bool known = true;
    for (int i = 0; i < count; ++i) {
        unsigned flags = 0;
        unsigned config = 0;
        unsigned values[8] = {};
        std::size_t value_count = std::size(values);
        char filter_name[64] = "";
        const H5Z_filter_t filter = H5Pget_filter2(properties, static_cast<unsigned>(i), &flags, &value_count,
                                                   values, sizeof(filter_name), filter_name, &config);
        if (filter < 0) return fail(ErrorCode::kCorrupt, last_error("reading the filters"), dataset.where);
        if (H5Zfilter_avail(filter) <= 0) {
            filter_name[sizeof(filter_name) - 1] = '\0';
            return fail(ErrorCode::kUnsupported,
                        "is packed with filter " + std::to_string(filter) +
                            (*filter_name ? " (" + std::string(filter_name) + ")" : "") +
                            ", which this HDF5 library does not have",
                        dataset.where);
        }
        if (filter == H5Z_FILTER_SHUFFLE && i == 0 && value_count > 0 && values[0] == dataset.value_bytes)
            packing.shuffle_index = i;
        else if (filter == H5Z_FILTER_DEFLATE && packing.deflate_index < 0)
            packing.deflate_index = i;
        else
            known = false;
    }
    unsigned options = 0;
    if (H5Pget_chunk_opts(properties, &options) < 0 || options != 0) known = false;
    if (!known || packing.deflate_index < 0)
        dataset.packing.reset();
    else if (dataset.packing)
        dataset.packing = packing;
    return {};
}

/// The chunk shape, and that every chunk was written: what HDF5 makes up for a missing one is no animation,
/// and it is how a small file declares a huge clip.
Expected<void> check_chunks(SourceDataset& dataset, hid_t properties, hid_t space) {
    std::vector<hsize_t> extents(dataset.shape.size());
    if (H5Pget_chunk(properties, static_cast<int>(extents.size()), extents.data()) !=
        static_cast<int>(extents.size()))
        return fail(ErrorCode::kCorrupt, last_error("reading the chunk shape"), dataset.where);
    std::optional<std::int64_t> chunk_bytes = static_cast<std::int64_t>(dataset.value_bytes);
    std::optional<std::int64_t> chunk_count = 1;
    for (std::size_t i = 0; i < extents.size(); ++i) {
        if (extents[i] == 0 || extents[i] > static_cast<hsize_t>(kMaxChunkBytes))
            return fail(ErrorCode::kCorrupt, "has a chunk shape that cannot be", dataset.where);
        const auto extent = static_cast<std::int64_t>(extents[i]);
        dataset.chunk.push_back(extent);
        if (chunk_bytes) chunk_bytes = checked_product(*chunk_bytes, extent);
        const std::int64_t along = dataset.shape[i] / extent + (dataset.shape[i] % extent != 0);
        if (chunk_count) chunk_count = checked_product(*chunk_count, along);
    }
    if (!chunk_bytes || !chunk_count || *chunk_bytes > kMaxChunkBytes)
        return fail(ErrorCode::kLimit, "has chunks of more than 4 GiB", dataset.where);
    hsize_t written = 0;
    if (H5Dget_num_chunks(dataset.handle.get(), space, &written) < 0)
        return fail(ErrorCode::kCorrupt, last_error("counting the chunks"), dataset.where);
    if (written != static_cast<hsize_t>(*chunk_count))
        return fail(ErrorCode::kFormat,
                    "is incomplete: " + std::to_string(written) + " of " + std::to_string(*chunk_count) +
                        " chunks were written",
                    dataset.where);
    return {};
}

Expected<void> check_storage(SourceDataset& dataset, std::int64_t file_bytes) {
    const Handle space(H5Dget_space(dataset.handle.get()), H5Sclose);
    const Handle properties(H5Dget_create_plist(dataset.handle.get()), H5Pclose);
    if (!space || !properties)
        return fail(ErrorCode::kCorrupt, last_error("reading the layout"), dataset.where);
    const H5D_layout_t layout = H5Pget_layout(properties.get());
    if (layout == H5D_VIRTUAL)
        return fail(ErrorCode::kUnsupported, "is a virtual dataset; only data in place is read",
                    dataset.where);
    if (layout != H5D_CONTIGUOUS && layout != H5D_CHUNKED && layout != H5D_COMPACT)
        return fail(ErrorCode::kUnsupported, "has an unknown storage layout", dataset.where);
    if (H5Pget_external_count(properties.get()) != 0)
        return fail(ErrorCode::kUnsupported, "is stored in other files; only data in place is read",
                    dataset.where);
    if (auto checked = check_filters(dataset, properties.get()); !checked) return checked;
    if (layout != H5D_CHUNKED) dataset.packing.reset();
    if (layout == H5D_CHUNKED)
        if (auto checked = check_chunks(dataset, properties.get(), space.get()); !checked) return checked;

    const hsize_t stored = H5Dget_storage_size(dataset.handle.get());
    if (stored > static_cast<hsize_t>(file_bytes))
        return fail(ErrorCode::kCorrupt, "claims more storage than the file has", dataset.where);
    // Deflate is bounded by its own ratio; what another filter makes of its bytes only HDF5 knows, whose
    // chunks are bounded by 4 GiB each.
    const bool filtered = H5Pget_nfilters(properties.get()) > 0;
    if (filtered && !dataset.packing) return {};
    const std::int64_t ratio = dataset.packing ? kMaxDeflateRatio : 1;
    if (dataset.size_bytes / ratio > static_cast<std::int64_t>(stored))
        return fail(ErrorCode::kCorrupt,
                    "declares " + std::to_string(dataset.size_bytes) + " bytes, but stores only " +
                        std::to_string(stored),
                    dataset.where);
    return {};
}

}  // namespace

Expected<std::optional<SourceDataset>> open_source_dataset(const InputFile& input,
                                                           const std::string& file_name,
                                                           const std::string& name, ValueKind kind,
                                                           std::size_t rank) {
    const std::string absolute = name.starts_with('/') ? name : "/" + name;
    SourceDataset dataset;
    dataset.name = absolute;
    dataset.where = file_name + ":" + absolute;
    if (absolute.find('\0') != std::string::npos)
        return fail(ErrorCode::kInvalidArgument, "the name of the dataset holds a NUL", file_name);
    const auto found = reaches_by_hard_links(input.file.get(), absolute, dataset.where);
    if (!found) return tl::unexpected(found.error());
    if (!*found) return std::optional<SourceDataset>{};

    dataset.handle = Handle(H5Dopen2(input.file.get(), absolute.c_str(), H5P_DEFAULT), H5Dclose);
    if (!dataset.handle) return fail(ErrorCode::kCorrupt, last_error("opening"), dataset.where);
    const Handle space(H5Dget_space(dataset.handle.get()), H5Sclose);
    if (!space) return fail(ErrorCode::kCorrupt, last_error("reading the shape"), dataset.where);
    auto shape = shape_of(space.get());
    if (!shape) return fail_within(dataset.where, std::move(shape.error()));
    dataset.shape = std::move(*shape);
    if (dataset.shape.size() != rank)
        return fail(
            ErrorCode::kFormat,
            "has " + std::to_string(dataset.shape.size()) + " dimensions instead of " + std::to_string(rank),
            dataset.where);
    if (auto checked = check_type(dataset, kind); !checked) return tl::unexpected(checked.error());
    std::optional<std::int64_t> size_bytes = static_cast<std::int64_t>(dataset.value_bytes);
    for (const std::int64_t extent : dataset.shape)
        if (size_bytes) size_bytes = checked_product(*size_bytes, extent);
    if (!size_bytes) return fail(ErrorCode::kLimit, "is larger than any machine", dataset.where);
    dataset.size_bytes = *size_bytes;
    if (auto checked = check_storage(dataset, input.size_bytes); !checked)
        return tl::unexpected(checked.error());
    return std::optional<SourceDataset>(std::move(dataset));
}

Expected<void> reopen_with_chunk_cache(SourceDataset& dataset) {
    constexpr std::int64_t kMaxCacheBytes = 256LL << 20;
    std::int64_t row_chunks = 1;
    std::int64_t chunk_bytes = static_cast<std::int64_t>(dataset.value_bytes);
    for (std::size_t i = 0; i < dataset.chunk.size(); ++i) {
        if (i > 0) row_chunks *= (dataset.shape[i] + dataset.chunk[i] - 1) / dataset.chunk[i];
        chunk_bytes *= dataset.chunk[i];
    }
    constexpr std::int64_t kDefaultCacheBytes = 1LL << 20;
    const std::int64_t wanted =
        row_chunks > kMaxCacheBytes / chunk_bytes ? kMaxCacheBytes : row_chunks * chunk_bytes;
    // HDF5 asks for a prime of about a hundred times the chunks that fit; these three do for all sizes.
    const std::int64_t slots = row_chunks < 100 ? 10007 : row_chunks < 1000 ? 100003 : 1000003;
    const Handle access(H5Pcreate(H5P_DATASET_ACCESS), H5Pclose);
    if (!access ||
        H5Pset_chunk_cache(access.get(), static_cast<std::size_t>(slots),
                           static_cast<std::size_t>(std::max(wanted, kDefaultCacheBytes)), 1.0) < 0)
        return fail(ErrorCode::kIo, last_error("setting the chunk cache"), dataset.where);
    const Handle file(H5Iget_file_id(dataset.handle.get()), H5Fclose);
    dataset.handle.close();  // the cache is set by whoever opens the dataset first
    dataset.handle = Handle(H5Dopen2(file.get(), dataset.name.c_str(), access.get()), H5Dclose);
    if (!dataset.handle) return fail(ErrorCode::kIo, last_error("opening"), dataset.where);
    return {};
}

}  // namespace batchenc::hdf5
