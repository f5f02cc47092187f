#include "io/hdf5/hdf5_handle.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <limits>
#include <new>

// Threads use files of their own at once: the graph reads one while it writes another, and a block of frames
// is visited, which may write, while the next one is read. HDF5's own lock is what makes that safe.
#ifndef H5_HAVE_THREADSAFE
#error "batchenc needs an HDF5 that was built thread-safe"
#endif

namespace batchenc::hdf5 {

namespace {

/// HDF5 must not tidy up at exit: what is open then is a temporary file that nobody wants, and after a close
/// that failed (full disk) the library keeps an identifier of freed memory, which it would follow. It only
/// listens before its first use, hence before main.
[[maybe_unused]] const bool kNoTidyingAtExit = H5dont_atexit() >= 0;

/// The operating system's words inside a description such as "file write failed: time = …, error message =
/// 'No space left on device', buf = 0x…", or the description itself.
std::string shorten(std::string text) {
    const std::string marker = "error message = '";
    if (const auto begin = text.find(marker); begin != std::string::npos) {
        const auto from = begin + marker.size();
        const auto end = text.find('\'', from);
        if (end != std::string::npos) text = text.substr(from, end - from);
    }
    for (char& c : text) {
        if (static_cast<unsigned char>(c) < 0x20) c = ' ';
    }
    constexpr std::size_t kLongest = 160;
    if (text.size() > kLongest) text = text.substr(0, kLongest) + "…";
    return text;
}

extern "C" herr_t take_first_description(unsigned, const H5E_error2_t* entry, void* text) {
    if (entry->desc == nullptr || *entry->desc == '\0') return 0;
    try {
        *static_cast<std::string*>(text) = entry->desc;
    } catch (const std::bad_alloc&) {
        return -1;
    }
    return 1;
}

struct NameList {
    std::vector<std::string> names;
    std::size_t limit = 0;
    bool over_limit = false;
    bool out_of_memory = false;

    herr_t add(const char* name) {
        if (names.size() >= limit) {
            over_limit = true;
            return -1;
        }
        try {
            names.emplace_back(name);
        } catch (const std::bad_alloc&) {
            out_of_memory = true;
            return -1;
        }
        return 0;
    }
};

extern "C" herr_t add_link_name(hid_t, const char* name, const H5L_info_t*, void* list) {
    return static_cast<NameList*>(list)->add(name);
}

extern "C" herr_t add_attribute_name(hid_t, const char* name, const H5A_info_t*, void* list) {
    return static_cast<NameList*>(list)->add(name);
}

Expected<std::vector<std::string>> finished_names(NameList& list, herr_t status, const char* doing) {
    if (list.over_limit)
        return fail(ErrorCode::kLimit, "more than " + std::to_string(list.limit) + " entries");
    if (list.out_of_memory) return fail(ErrorCode::kOutOfMemory, "no memory for the list of entries");
    if (status < 0) return fail(ErrorCode::kIo, last_error(doing));
    std::sort(list.names.begin(), list.names.end());
    return std::move(list.names);
}

Expected<void> write_scalar_attribute(hid_t object, const char* name, hid_t file_type, hid_t memory_type,
                                      const void* value) {
    const Handle space(H5Screate(H5S_SCALAR), H5Sclose);
    Handle attribute(H5Acreate2(object, name, file_type, space.get(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
    if (!attribute || H5Awrite(attribute.get(), memory_type, value) < 0 || !attribute.close())
        return fail(ErrorCode::kIo, last_error(std::string("writing attribute ") + name));
    return {};
}

/// File access properties: no dependence on what a file system says about locks when locking is switched
/// off, and a close that closes whatever still hangs on the file.
Handle file_access() {
    Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
    if (!access || H5Pset_fclose_degree(access.get(), H5F_CLOSE_STRONG) < 0 ||
        H5Pset_file_locking(access.get(), true, true) < 0)
        return {};
    return access;
}

}  // namespace

void prepare_thread() {
    thread_local bool quiet = false;
    if (!quiet) quiet = H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr) >= 0;
}

std::string last_error(std::string_view doing) {
    std::string cause;
    H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, take_first_description, &cause);
    std::string text(doing);
    return cause.empty() ? text + " failed" : text + ": " + shorten(std::move(cause));
}

Expected<InputFile> open_input(const std::filesystem::path& path) {
    prepare_thread();
    const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (descriptor < 0)
        return fail(ErrorCode::kIo, std::string("cannot open: ") + std::strerror(errno), path.string());
    struct stat status {};
    const int stat_result = ::fstat(descriptor, &status);
    ::close(descriptor);
    if (stat_result != 0 || !S_ISREG(status.st_mode))
        return fail(ErrorCode::kIo, "not a regular file", path.string());

    const htri_t is_hdf5 = H5Fis_hdf5(path.c_str());
    if (is_hdf5 < 0) return fail(ErrorCode::kIo, last_error("cannot open"), path.string());
    if (is_hdf5 == 0) return fail(ErrorCode::kFormat, "not an HDF5 file", path.string());
    const Handle access = file_access();
    InputFile input;
    if (access) input.file = Handle(H5Fopen(path.c_str(), H5F_ACC_RDONLY, access.get()), H5Fclose);
    if (!input.file) return fail(ErrorCode::kCorrupt, last_error("damaged HDF5 file"), path.string());
    input.size_bytes = status.st_size;
    return input;
}

Expected<Handle> create_output(const std::filesystem::path& path) {
    prepare_thread();
    const Handle access = file_access();
    const Handle creation(H5Pcreate(H5P_FILE_CREATE), H5Pclose);  // of the root group too
    Handle file;
    if (access && creation && H5Pset_obj_track_times(creation.get(), false) >= 0 &&
        H5Pset_libver_bounds(access.get(), H5F_LIBVER_V18, H5F_LIBVER_V18) >= 0)
        file = Handle(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, creation.get(), access.get()), H5Fclose);
    if (!file) return fail(ErrorCode::kIo, last_error("cannot create"), path.string());
    return file;
}

Expected<void> close_output(Handle& file, const std::string& where) {
    if (H5Fflush(file.get(), H5F_SCOPE_LOCAL) < 0) return fail(ErrorCode::kIo, last_error("flushing"), where);
    if (!file.close()) return fail(ErrorCode::kIo, last_error("closing"), where);
    return {};
}

Expected<void> write_attribute(hid_t object, const char* name, std::int64_t value) {
    return write_scalar_attribute(object, name, H5T_STD_I64LE, H5T_NATIVE_INT64, &value);
}

Expected<void> write_attribute(hid_t object, const char* name, double value) {
    return write_scalar_attribute(object, name, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, &value);
}

Expected<void> write_attribute(hid_t object, const char* name, const std::string& value) {
    if (value.find('\0') != std::string::npos)
        return fail(ErrorCode::kInvalidArgument, std::string("attribute ") + name + " holds a NUL character");
    const Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
    // HDF5 has no strings of length 0: an empty one is a single NUL of padding, and reads as empty.
    if (!type || H5Tset_size(type.get(), std::max<std::size_t>(value.size(), 1)) < 0 ||
        H5Tset_strpad(type.get(), H5T_STR_NULLPAD) < 0 || H5Tset_cset(type.get(), H5T_CSET_UTF8) < 0)
        return fail(ErrorCode::kIo, last_error(std::string("writing attribute ") + name));
    return write_scalar_attribute(object, name, type.get(), type.get(), value.c_str());
}

Expected<Handle> create_group(hid_t file, const char* path) {
    const Handle properties(H5Pcreate(H5P_GROUP_CREATE), H5Pclose);
    Handle group;
    if (properties && H5Pset_obj_track_times(properties.get(), false) >= 0)
        group = Handle(H5Gcreate2(file, path, H5P_DEFAULT, properties.get(), H5P_DEFAULT), H5Gclose);
    if (!group) return fail(ErrorCode::kIo, last_error(std::string("creating ") + path));
    return group;
}

Expected<Handle> create_contiguous(hid_t group, const char* name, hid_t type,
                                   const std::vector<hsize_t>& shape) {
    const Handle space(H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr), H5Sclose);
    const Handle properties(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
    Handle dataset;
    if (space && properties && H5Pset_layout(properties.get(), H5D_CONTIGUOUS) >= 0 &&
        H5Pset_fill_time(properties.get(), H5D_FILL_TIME_NEVER) >= 0 &&
        H5Pset_obj_track_times(properties.get(), false) >= 0)
        dataset = Handle(
            H5Dcreate2(group, name, type, space.get(), H5P_DEFAULT, properties.get(), H5P_DEFAULT), H5Dclose);
    if (!dataset) return fail(ErrorCode::kIo, last_error(std::string("creating ") + name));
    return dataset;
}

Expected<void> write_vector(hid_t group, const char* name, hid_t file_type, hid_t memory_type,
                            const void* values, std::size_t count) {
    auto dataset = create_contiguous(group, name, file_type, {count});
    if (!dataset) return tl::unexpected(dataset.error());
    if (H5Dwrite(dataset->get(), memory_type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values) < 0)
        return fail(ErrorCode::kIo, last_error(std::string("writing ") + name));
    if (!dataset->close()) return fail(ErrorCode::kIo, last_error(std::string("closing ") + name));
    return {};
}

Expected<std::vector<std::int64_t>> shape_of(hid_t dataspace) {
    const int rank = H5Sget_simple_extent_ndims(dataspace);
    const H5S_class_t kind = H5Sget_simple_extent_type(dataspace);
    if (rank < 0 || (kind != H5S_SIMPLE && kind != H5S_SCALAR))
        return fail(ErrorCode::kFormat, "has no elements (null dataspace)");
    std::vector<hsize_t> extents(static_cast<std::size_t>(rank));
    if (rank > 0 && H5Sget_simple_extent_dims(dataspace, extents.data(), nullptr) < 0)
        return fail(ErrorCode::kIo, last_error("reading the shape"));
    std::vector<std::int64_t> shape;
    for (const hsize_t extent : extents) {
        if (extent > static_cast<hsize_t>(std::numeric_limits<std::int64_t>::max()))
            return fail(ErrorCode::kLimit, "an extent of " + std::to_string(extent) + " is beyond any limit");
        shape.push_back(static_cast<std::int64_t>(extent));
    }
    return shape;
}

Expected<std::vector<std::string>> link_names(hid_t group, std::size_t limit) {
    NameList list;
    list.limit = limit;
    const herr_t status = H5Literate(group, H5_INDEX_NAME, H5_ITER_NATIVE, nullptr, add_link_name, &list);
    return finished_names(list, status, "listing a group");
}

Expected<std::vector<std::string>> attribute_names(hid_t object, std::size_t limit) {
    NameList list;
    list.limit = limit;
    const herr_t status =
        H5Aiterate2(object, H5_INDEX_NAME, H5_ITER_NATIVE, nullptr, add_attribute_name, &list);
    return finished_names(list, status, "listing attributes");
}

}  // namespace batchenc::hdf5
