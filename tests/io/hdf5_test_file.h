#pragma once

#include <hdf5.h>
#include <unistd.h>

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

namespace batchenc::testing {

/// A folder of its own for one test, removed with everything in it.
class TemporaryFolder {
 public:
    TemporaryFolder() {
        static std::atomic<int> number{0};
        path_ = std::filesystem::temp_directory_path() /
                ("batchenc_io_" + std::to_string(::getpid()) + "_" + std::to_string(number++));
        std::filesystem::create_directories(path_);
    }
    ~TemporaryFolder() {
        std::error_code ignored;
        std::filesystem::remove_all(path_, ignored);
    }
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;

    std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
    std::size_t file_count() const {
        return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(path_), {}));
    }

 private:
    std::filesystem::path path_;
};

/// How the writers of this process name the file beside `name`.
inline std::string temporary_name(const std::string& name, int number) {
    return name + "." + std::to_string(::getpid()) + "." + std::to_string(number) + ".tmp";
}

inline std::string read_bytes(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

inline void write_bytes(const std::filesystem::path& path, const std::string& bytes) {
    std::ofstream(path, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

/// Smooth positions: what a chunk of an animation looks like to a packer.
inline std::vector<float> smooth_positions(std::int64_t frames, std::int64_t vertices) {
    std::vector<float> values;
    for (std::int64_t f = 0; f < frames; ++f)
        for (std::int64_t v = 0; v < vertices; ++v)
            for (std::int64_t k = 0; k < 3; ++k)
                values.push_back(static_cast<float>(v % 17) * 0.25F + static_cast<float>(k) +
                                 static_cast<float>(f) * 0.125F);
    return values;
}

/// Every bit random, but finite: nothing that a packer could shrink.
inline std::vector<float> noise_positions(std::int64_t frames, std::int64_t vertices) {
    std::mt19937 random(7);
    std::vector<float> values(static_cast<std::size_t>(frames * vertices * 3));
    for (float& value : values) value = static_cast<float>(random()) * 1e-3F;
    return values;
}

/// An HDF5 file made by hand, with the C API, so that a test may do what the writers of this project never
/// do.
class HandmadeFile {
 public:
    explicit HandmadeFile(const std::filesystem::path& path)
        : id_(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT)) {}
    ~HandmadeFile() { H5Fclose(id_); }
    HandmadeFile(const HandmadeFile&) = delete;
    HandmadeFile& operator=(const HandmadeFile&) = delete;

    hid_t id() const { return id_; }

    /// Creates a dataset; chunk may be empty (contiguous). `configure(properties)` adds filters and the like.
    template <typename Configure>
    hid_t create(const char* name, hid_t type, std::vector<hsize_t> shape, std::vector<hsize_t> chunk,
                 Configure&& configure) {
        const hid_t properties = H5Pcreate(H5P_DATASET_CREATE);
        if (!chunk.empty()) H5Pset_chunk(properties, static_cast<int>(chunk.size()), chunk.data());
        configure(properties);
        const std::vector<hsize_t> largest(shape.size(), H5S_UNLIMITED);
        const hid_t space = H5Screate_simple(static_cast<int>(shape.size()), shape.data(),
                                             chunk.empty() ? nullptr : largest.data());
        const hid_t dataset = H5Dcreate2(id_, name, type, space, H5P_DEFAULT, properties, H5P_DEFAULT);
        H5Sclose(space);
        H5Pclose(properties);
        return dataset;
    }

    /// Creates and writes a dataset from values of memory_type.
    template <typename Configure>
    void add(const char* name, hid_t type, std::vector<hsize_t> shape, std::vector<hsize_t> chunk,
             hid_t memory_type, const void* values, Configure&& configure) {
        const hid_t dataset = create(name, type, std::move(shape), std::move(chunk), configure);
        H5Dwrite(dataset, memory_type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values);
        H5Dclose(dataset);
    }
    void add(const char* name, hid_t type, std::vector<hsize_t> shape, hid_t memory_type,
             const void* values) {
        add(name, type, std::move(shape), {}, memory_type, values, [](hid_t) {});
    }
    void add_positions(const std::vector<float>& values, std::int64_t frames, std::int64_t vertices) {
        add("positions", H5T_IEEE_F32LE, {static_cast<hsize_t>(frames), static_cast<hsize_t>(vertices), 3},
            H5T_NATIVE_FLOAT, values.data());
    }

 private:
    hid_t id_;
};

}  // namespace batchenc::testing
