#include <algorithm>
#include <limits>
#include <new>
#include <optional>
#include <utility>

#include "io/hdf5/durable_file.h"
#include "io/hdf5/hdf5_handle.h"
#include "io/source_clip.h"

namespace batchenc {

namespace {

using hdf5::Handle;
using hdf5::last_error;

/// Positions are contiguous: frames go to the disk as they come, without a copy or a chunk index, and every
/// reader takes any range of them at the speed of the disk. Packing a decoded clip is what results are for.
class Hdf5ClipWriter final : public ClipWriter {
 public:
    Hdf5ClipWriter(DurableFile target, std::int64_t frame_count, std::int64_t vertex_count)
        : target_(std::move(target)),
          where_(target_.path().string()),
          frame_count_(frame_count),
          vertex_count_(vertex_count) {}

    Expected<void> begin(std::span<const Triangle> triangles, double fps, const std::string& name) {
        written_.resize(static_cast<std::size_t>(frame_count_), false);
        auto file = hdf5::create_output(target_.temporary_path());
        if (!file) return tl::unexpected(file.error());
        file_ = std::move(*file);
        // MATLAB shows HDF5's dimensions in reverse; the attribute says which is which.
        for (auto done :
             {hdf5::write_attribute(file_.get(), "axis_order", std::string("[frame][vertex][xyz]")),
              hdf5::write_attribute(file_.get(), "fps", fps),
              hdf5::write_attribute(file_.get(), "name", name)})
            if (!done) return fail_within(where_, std::move(done.error()));
        if (!triangles.empty()) {
            auto dataset =
                hdf5::create_contiguous(file_.get(), "triangles", H5T_STD_I32LE, {triangles.size(), 3});
            if (!dataset) return fail_within(where_, std::move(dataset.error()));
            if (H5Dwrite(dataset->get(), H5T_NATIVE_INT32, H5S_ALL, H5S_ALL, H5P_DEFAULT, triangles.data()) <
                    0 ||
                !dataset->close())
                return fail(ErrorCode::kIo, last_error("writing triangles"), where_);
        }
        auto positions = hdf5::create_contiguous(
            file_.get(), "positions", H5T_IEEE_F32LE,
            {static_cast<hsize_t>(frame_count_), static_cast<hsize_t>(vertex_count_), 3});
        if (!positions) return fail_within(where_, std::move(positions.error()));
        positions_ = std::move(*positions);
        return {};
    }

    Expected<void> write_frames(std::int64_t begin, PositionsView frames) override {
        hdf5::prepare_thread();
        const std::int64_t count = frames.frame_count();
        if (!positions_) return fail(ErrorCode::kInvalidArgument, "is finished already", where_);
        if (frames.vertex_count() != vertex_count_ || begin < 0 || count < 0 || begin > frame_count_ ||
            count > frame_count_ - begin)
            return fail(ErrorCode::kInvalidArgument,
                        "frames " + std::to_string(begin) + " to " + std::to_string(begin + count - 1) +
                            " of " + std::to_string(frames.vertex_count()) +
                            " vertices do not fit into the clip",
                        where_);
        if (count == 0) return {};
        const hsize_t start[3] = {static_cast<hsize_t>(begin), 0, 0};
        const hsize_t size[3] = {static_cast<hsize_t>(count), static_cast<hsize_t>(vertex_count_), 3};
        const Handle file_space(H5Dget_space(positions_.get()), H5Sclose);
        const Handle memory_space(H5Screate_simple(3, size, nullptr), H5Sclose);
        if (!file_space || !memory_space ||
            H5Sselect_hyperslab(file_space.get(), H5S_SELECT_SET, start, nullptr, size, nullptr) < 0 ||
            H5Dwrite(positions_.get(), H5T_NATIVE_FLOAT, memory_space.get(), file_space.get(), H5P_DEFAULT,
                     frames.data()) < 0)
            return fail(ErrorCode::kIo, last_error("writing positions"), where_);
        std::fill_n(written_.begin() + begin, count, true);
        target_.begin_writing_out();
        return {};
    }

    Expected<void> finish() override {
        hdf5::prepare_thread();
        if (!positions_) return fail(ErrorCode::kInvalidArgument, "is finished already", where_);
        auto finished = close_and_commit();
        if (!finished) {
            positions_.close();
            file_.close();
            target_.discard();
        }
        return finished;
    }

 private:
    Expected<void> close_and_commit() {
        const auto missing = std::find(written_.begin(), written_.end(), false);
        if (missing != written_.end())
            return fail(ErrorCode::kInvalidArgument,
                        "frame " + std::to_string(missing - written_.begin()) + " was never written", where_);
        if (!positions_.close()) return fail(ErrorCode::kIo, last_error("closing positions"), where_);
        if (auto closed = hdf5::close_output(file_, where_); !closed) return closed;
        return target_.commit();
    }

    DurableFile target_;  // first, so that the file is closed before it is removed
    std::string where_;
    std::int64_t frame_count_;
    std::int64_t vertex_count_;
    std::vector<bool> written_;
    Handle file_;
    Handle positions_;
};

}  // namespace

Expected<std::unique_ptr<ClipWriter>> ClipWriter::create(const std::filesystem::path& path,
                                                         std::int64_t frame_count, std::int64_t vertex_count,
                                                         std::span<const Triangle> triangles, double fps,
                                                         const std::string& name, bool overwrite) {
    std::int64_t size_bytes = 0;
    if (frame_count < 1 || vertex_count < 1 || vertex_count > std::numeric_limits<std::int32_t>::max() ||
        __builtin_mul_overflow(frame_count, vertex_count * 12, &size_bytes))
        return fail(ErrorCode::kInvalidArgument,
                    "no clip has " + std::to_string(frame_count) + " frames of " +
                        std::to_string(vertex_count) + " vertices",
                    path.string());
    try {
        auto target = DurableFile::create(path, overwrite);
        if (!target) return tl::unexpected(target.error());
        auto writer = std::make_unique<Hdf5ClipWriter>(std::move(*target), frame_count, vertex_count);
        if (auto begun = writer->begin(triangles, fps, name); !begun) return tl::unexpected(begun.error());
        return writer;
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::kOutOfMemory, "no memory to write the clip", path.string());
    }
}

}  // namespace batchenc
