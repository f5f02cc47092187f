#include "io/source_clip.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <new>
#include <optional>
#include <utility>

#include "io/hdf5/chunk_reader.h"
#include "io/hdf5/finite_check.h"
#include "io/hdf5/hdf5_handle.h"
#include "io/hdf5/source_attributes.h"
#include "io/hdf5/source_dataset.h"

namespace batchenc {

namespace {

using hdf5::last_error;

/// Selects rows [begin, begin + count) of a dataset and reads them as `memory_type` into values.
Expected<void> read_rows(const hdf5::SourceDataset& dataset, std::int64_t begin, std::int64_t count,
                         hid_t memory_type, void* values) {
    std::vector<hsize_t> start(dataset.shape.size(), 0);
    std::vector<hsize_t> size(dataset.shape.begin(), dataset.shape.end());
    start[0] = static_cast<hsize_t>(begin);
    size[0] = static_cast<hsize_t>(count);
    const hdf5::Handle file_space(H5Dget_space(dataset.handle.get()), H5Sclose);
    const hdf5::Handle memory_space(H5Screate_simple(static_cast<int>(size.size()), size.data(), nullptr),
                                    H5Sclose);
    if (!file_space || !memory_space ||
        H5Sselect_hyperslab(file_space.get(), H5S_SELECT_SET, start.data(), nullptr, size.data(), nullptr) <
            0 ||
        H5Dread(dataset.handle.get(), memory_type, memory_space.get(), file_space.get(), H5P_DEFAULT,
                values) < 0)
        return fail(ErrorCode::kIo, last_error("reading"), dataset.where);
    return {};
}

Expected<void> check_shape(const hdf5::SourceDataset& dataset, const char* rows, std::int64_t max_rows) {
    if (dataset.shape.back() != 3)
        return fail(ErrorCode::kFormat,
                    "has a last dimension of " + std::to_string(dataset.shape.back()) + " instead of 3",
                    dataset.where);
    if (dataset.shape[0] > max_rows)
        return fail(ErrorCode::kLimit,
                    std::to_string(dataset.shape[0]) + " " + rows + " are more than the " +
                        std::to_string(max_rows) + " allowed",
                    dataset.where);
    return {};
}

class Hdf5SourceClip final : public SourceClip {
 public:
    Expected<void> open_checked(const std::filesystem::path& path, const SourceNames& names,
                                const SourceLimits& limits) {
        auto input = hdf5::open_input(path);
        if (!input) return tl::unexpected(input.error());
        input_ = std::move(*input);
        if (auto opened = open_positions(path.string(), names, limits); !opened) return opened;
        if (auto opened = open_triangles(path.string(), names, limits); !opened) return opened;
        if (const auto fps = hdf5::read_optional_number(input_.file.get(), "fps"); fps && *fps > 0.0)
            fps_ = *fps;
        name_ = hdf5::read_optional_text(input_.file.get(), "name").value_or("");
        return {};
    }

    std::int64_t frame_count() const override { return positions_.shape[0]; }
    std::int64_t vertex_count() const override { return positions_.shape[1]; }
    std::int64_t triangle_count() const override { return triangles_ ? triangles_->shape[0] : 0; }
    double fps() const override { return fps_; }
    const std::string& name() const override { return name_; }

    Expected<std::vector<Triangle>> read_triangles() override {
        hdf5::prepare_thread();
        try {
            return read_triangles_checked();
        } catch (const std::bad_alloc&) {
            return fail(ErrorCode::kOutOfMemory, "no memory for the triangles", triangles_->where);
        }
    }

    Expected<void> read_frames(std::int64_t begin, MutablePositionsView out,
                               const Executor& executor) override {
        hdf5::prepare_thread();
        const std::int64_t count = out.frame_count();
        if (out.vertex_count() != vertex_count())
            return fail(ErrorCode::kInvalidArgument,
                        "asked for " + std::to_string(out.vertex_count()) + " vertices of " +
                            std::to_string(vertex_count()),
                        positions_.where);
        if (begin < 0 || count < 0 || begin > frame_count() || count > frame_count() - begin)
            return fail(ErrorCode::kOutOfRange,
                        "has no frames " + std::to_string(begin) + " to " +
                            std::to_string(begin + count - 1) + ", only " + std::to_string(frame_count()),
                        positions_.where);
        if (count == 0) return {};
        auto read = chunks_ ? chunks_->read(begin, out, executor)
                            : read_rows(positions_, begin, count, H5T_NATIVE_FLOAT, out.data());
        if (!read) return read;
        return check_finite(begin, out);
    }

 private:
    Expected<void> open_positions(const std::string& file_name, const SourceNames& names,
                                  const SourceLimits& limits) {
        auto positions =
            hdf5::open_source_dataset(input_, file_name, names.positions, hdf5::ValueKind::kFloat, 3);
        if (!positions) return tl::unexpected(positions.error());
        if (!*positions) return fail(ErrorCode::kFormat, "has no dataset " + names.positions, file_name);
        positions_ = std::move(**positions);
        if (auto checked = check_shape(positions_, "frames", limits.max_frames); !checked) return checked;
        if (vertex_count() >
            std::min<std::int64_t>(limits.max_vertices, std::numeric_limits<std::int32_t>::max()))
            return fail(ErrorCode::kLimit,
                        std::to_string(vertex_count()) + " vertices are more than the " +
                            std::to_string(limits.max_vertices) + " allowed",
                        positions_.where);
        if (frame_count() == 0) return fail(ErrorCode::kFormat, "has no frames", positions_.where);
        if (vertex_count() == 0) return fail(ErrorCode::kFormat, "has no vertices", positions_.where);
        if (positions_.packing) {
            chunks_.emplace(positions_);
        } else if (!positions_.chunk.empty()) {
            return hdf5::reopen_with_chunk_cache(positions_);
        }
        return {};
    }

    Expected<void> open_triangles(const std::string& file_name, const SourceNames& names,
                                  const SourceLimits& limits) {
        auto triangles =
            hdf5::open_source_dataset(input_, file_name, names.triangles, hdf5::ValueKind::kInteger, 2);
        if (!triangles) return tl::unexpected(triangles.error());
        if (*triangles) {
            triangles_ = std::move(**triangles);
            return check_shape(*triangles_, "triangles", limits.max_triangles);
        }
        // Whoever names the triangles does not mean points: a misspelt name must not lose them.
        if (names.triangles != SourceNames{}.triangles)
            return fail(ErrorCode::kFormat, "has no dataset " + names.triangles, file_name);
        return {};
    }

    Expected<std::vector<Triangle>> read_triangles_checked() const {
        std::vector<Triangle> triangles;
        if (!triangles_) return triangles;
        // In runs, so that the wide indices (a file may hold 64 bits) never take more than these few bytes.
        constexpr std::int64_t kRun = 1 << 16;
        const std::int64_t count = triangles_->shape[0];
        triangles.resize(static_cast<std::size_t>(count));
        std::vector<std::array<std::int64_t, 3>> wide(static_cast<std::size_t>(std::min(kRun, count)));
        for (std::int64_t begin = 0; begin < count; begin += kRun) {
            const std::int64_t run = std::min(kRun, count - begin);
            if (auto read = read_rows(*triangles_, begin, run, H5T_NATIVE_INT64, wide.data()); !read)
                return tl::unexpected(read.error());
            for (std::int64_t t = 0; t < run; ++t) {
                for (std::size_t corner = 0; corner < 3; ++corner) {
                    const std::int64_t index = wide[static_cast<std::size_t>(t)][corner];
                    if (index < 0 || index >= vertex_count())
                        return fail(ErrorCode::kOutOfRange,
                                    "triangle " + std::to_string(begin + t) + " has vertex index " +
                                        std::to_string(index) + "; the clip has " +
                                        std::to_string(vertex_count()) + " vertices",
                                    triangles_->where);
                    triangles[static_cast<std::size_t>(begin + t)][corner] = static_cast<std::int32_t>(index);
                }
            }
        }
        return triangles;
    }

    Expected<void> check_finite(std::int64_t begin, PositionsView frames) const {
        const std::int64_t bad =
            first_non_finite({frames.data(), static_cast<std::size_t>(frames.value_count())});
        if (bad < 0) return {};
        const std::int64_t frame_values = vertex_count() * 3;
        const char* what = std::isnan(frames.data()[bad]) ? "NaN"
                           : positions_.value_bytes == 8  ? "infinity, or a number too large for float32,"
                                                          : "infinity";
        return fail(ErrorCode::kNotFinite,
                    std::string(what) + " at frame " + std::to_string(begin + bad / frame_values) +
                        ", vertex " + std::to_string(bad % frame_values / 3) + ", coordinate " +
                        "xyz"[bad % 3],
                    positions_.where);
    }

    hdf5::InputFile input_;
    hdf5::SourceDataset positions_;
    std::optional<hdf5::SourceDataset> triangles_;
    std::optional<ChunkReader> chunks_;
    double fps_ = 0.0;
    std::string name_;
};

}  // namespace

Expected<std::unique_ptr<SourceClip>> SourceClip::open(const std::filesystem::path& path,
                                                       const SourceNames& names, const SourceLimits& limits) {
    try {
        auto clip = std::make_unique<Hdf5SourceClip>();
        if (auto opened = clip->open_checked(path, names, limits); !opened)
            return tl::unexpected(opened.error());
        return clip;
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::kOutOfMemory, "no memory to open the clip", path.string());
    }
}

Expected<MeshSequence> read_mesh_sequence(const std::filesystem::path& path) {
    auto clip = SourceClip::open(path);
    if (!clip) return tl::unexpected(clip.error());
    MeshSequence sequence;
    sequence.frame_count = (*clip)->frame_count();
    sequence.vertex_count = (*clip)->vertex_count();
    sequence.fps = (*clip)->fps();
    sequence.name = (*clip)->name();
    auto triangles = (*clip)->read_triangles();
    if (!triangles) return tl::unexpected(triangles.error());
    sequence.triangles = std::move(*triangles);
    std::int64_t value_count = 0;
    if (__builtin_mul_overflow(sequence.frame_count, sequence.vertex_count * 3, &value_count))
        return fail(ErrorCode::kLimit, "is larger than any machine", path.string());
    try {
        sequence.positions.resize(static_cast<std::size_t>(value_count));
    } catch (const std::exception&) {
        return fail(ErrorCode::kOutOfMemory,
                    "no memory for " + std::to_string(sequence.frame_count) + " frames of " +
                        std::to_string(sequence.vertex_count) + " vertices",
                    path.string());
    }
    if (auto read = (*clip)->read_frames(0, sequence.view()); !read) return tl::unexpected(read.error());
    return sequence;
}

}  // namespace batchenc
