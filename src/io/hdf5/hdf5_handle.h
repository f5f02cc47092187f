#pragma once

#include <hdf5.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/error.h"

/// A thin owner for what the HDF5 C API hands out. Nothing outside src/io includes it.
namespace batchenc::hdf5 {

/// One HDF5 identifier and the call that gives it back.
class Handle {
 public:
    using CloseFunction = herr_t (*)(hid_t);

    Handle() = default;
    /// A negative id, as a failed HDF5 call returns it, makes an empty handle.
    Handle(hid_t id, CloseFunction close_function) : id_(id), close_function_(close_function) {}
    Handle(Handle&& other) noexcept
        : id_(std::exchange(other.id_, H5I_INVALID_HID)), close_function_(other.close_function_) {}
    Handle& operator=(Handle&& other) noexcept {
        if (this != &other) {
            close();
            id_ = std::exchange(other.id_, H5I_INVALID_HID);
            close_function_ = other.close_function_;
        }
        return *this;
    }
    Handle(const Handle&) = delete;
    Handle& operator=(const Handle&) = delete;
    ~Handle() { close(); }

    explicit operator bool() const { return id_ >= 0; }
    hid_t get() const { return id_; }

    /// Closes now and says whether HDF5 could; true for an empty handle. A writer must ask: on a full disk
    /// the close of a dataset may be the only call that fails.
    bool close() {
        const hid_t id = std::exchange(id_, H5I_INVALID_HID);
        return id < 0 || close_function_(id) >= 0;
    }

 private:
    hid_t id_ = H5I_INVALID_HID;
    CloseFunction close_function_ = nullptr;
};

/// Keeps HDF5 from printing its error stack in the calling thread; the switch is per thread. Every function
/// of src/io that may be the first to call HDF5 in its thread calls this first; later calls cost a flag test.
void prepare_thread();

/// "doing: cause" with the most specific entry of the calling thread's HDF5 error stack, in one short line.
/// To be called before any other HDF5 call, because each of them clears the stack.
std::string last_error(std::string_view doing);

/// A file opened for reading.
struct InputFile {
    Handle file;
    std::int64_t size_bytes = 0;  ///< as the file system has it; bounds every allocation
};

/// Opens an existing HDF5 file for reading. Errors: kIo (missing, unreadable, no regular file), kFormat (not
/// HDF5), kCorrupt (HDF5, but damaged or cut off); `where` is the path.
Expected<InputFile> open_input(const std::filesystem::path& path);

/// Creates an HDF5 file over an existing empty one, readable by every HDF5 from 1.8 on (library bounds
/// V18 to V18: metadata with checksums, superblock 2). Error: kIo.
Expected<Handle> create_output(const std::filesystem::path& path);

/// Flushes and closes an output file with every return code looked at. Error: kIo.
Expected<void> close_output(Handle& file, const std::string& where);

/// Writes a scalar attribute: int64 and float64 little-endian, strings of fixed length in UTF-8 without a
/// terminator. Errors: kIo, kInvalidArgument (a string with a NUL inside).
Expected<void> write_attribute(hid_t object, const char* name, std::int64_t value);
Expected<void> write_attribute(hid_t object, const char* name, double value);
Expected<void> write_attribute(hid_t object, const char* name, const std::string& value);

/// Creates a group that does not note when. Error: kIo.
Expected<Handle> create_group(hid_t file, const char* path);

/// Creates a dataset of `type`, contiguous and never pre-filled, without writing to it. Error: kIo.
Expected<Handle> create_contiguous(hid_t group, const char* name, hid_t type,
                                   const std::vector<hsize_t>& shape);

/// Creates a contiguous one-dimensional dataset, writes all of it and closes it. Error: kIo.
Expected<void> write_vector(hid_t group, const char* name, hid_t file_type, hid_t memory_type,
                            const void* values, std::size_t count);

/// The shape of a dataset or attribute's dataspace, each extent within int64. Empty for a scalar. Errors:
/// kFormat (null dataspace), kIo.
Expected<std::vector<std::int64_t>> shape_of(hid_t dataspace);

/// Names of the links of a group, sorted bytewise; refuses more than `limit` (kLimit). Error: kIo.
Expected<std::vector<std::string>> link_names(hid_t group, std::size_t limit);

/// Names of an object's attributes, sorted bytewise; refuses more than `limit` (kLimit). Error: kIo.
Expected<std::vector<std::string>> attribute_names(hid_t object, std::size_t limit);

}  // namespace batchenc::hdf5
