#include <cstring>
#include <new>
#include <utility>

#include "io/hdf5/hdf5_handle.h"
#include "io/hdf5/result_digest.h"
#include "io/hdf5/result_layout.h"
#include "io/hdf5/result_scan.h"
#include "io/result_file.h"
#include "io/source_clip.h"

namespace batchenc {

namespace {

using hdf5::Handle;
using hdf5::last_error;

class Hdf5ResultReader final : public ResultReader {
 public:
    explicit Hdf5ResultReader(std::string where) : where_(std::move(where)) {}

    Expected<void> open_checked(const std::filesystem::path& path) {
        auto input = hdf5::open_input(path);
        if (!input) return tl::unexpected(input.error());
        input_ = std::move(*input);
        root_ = Handle(H5Gopen2(input_.file.get(), "/", H5P_DEFAULT), H5Gclose);
        if (!root_) return fail(ErrorCode::kCorrupt, last_error("opening the root group"), where_);
        for (const auto step :
             {&Hdf5ResultReader::check_format, &Hdf5ResultReader::check_digest,
              &Hdf5ResultReader::read_header, &Hdf5ResultReader::read_clips, &Hdf5ResultReader::read_metrics})
            if (auto done = (this->*step)(); !done) return fail_within(where_, std::move(done.error()));
        return {};
    }

    const ResultHeader& header() const override { return header_; }
    const ResultMetrics& metrics() const override { return metrics_; }
    const std::vector<ClipSpan>& clips() const override { return clips_; }

    Expected<std::vector<std::uint8_t>> read_connectivity() override {
        if (header_.triangle_count == 0) return std::vector<std::uint8_t>{};
        return read_bitstream(result_layout::kConnectivity);
    }

    Expected<std::vector<std::uint8_t>> read_clip(std::int64_t index) override {
        if (index < 0 || index >= static_cast<std::int64_t>(clips_.size()))
            return fail(ErrorCode::kOutOfRange,
                        "has no clip " + std::to_string(index) + ", only " + std::to_string(clips_.size()),
                        where_);
        return read_bitstream(clip_path(index));
    }

 private:
    static std::string clip_path(std::int64_t index) {
        return std::string(result_layout::kClips) + "/" + result_layout::clip_name(index);
    }

    template <typename Number>
    Expected<Number> number(hid_t object, const char* name) const {
        constexpr ContentKind kKind =
            std::is_same_v<Number, double> ? ContentKind::kFloat64 : ContentKind::kInt64;
        const auto bytes = read_result_attribute(input_, object, name, kKind);
        if (!bytes) return tl::unexpected(bytes.error());
        Number value{};
        std::memcpy(&value, bytes->data(), sizeof(value));
        return value;
    }

    Expected<void> read_text(const char* name, std::string& text) const {
        auto bytes = read_result_attribute(input_, root_.get(), name, ContentKind::kString);
        if (!bytes) return tl::unexpected(bytes.error());
        text = std::move(*bytes);
        text.resize(::strnlen(text.data(), text.size()));
        return {};
    }

    Expected<void> check_format() {
        std::string format;
        if (H5Aexists(root_.get(), "format") <= 0 || !read_text("format", format) ||
            format != result_layout::kFormatName)
            return fail(ErrorCode::kFormat, "not a batchenc result");
        const auto version = number<std::int64_t>(root_.get(), "format_version");
        if (!version) return tl::unexpected(version.error());
        if (*version != result_layout::kFormatVersion)
            return fail(ErrorCode::kUnsupported, "is of format version " + std::to_string(*version) +
                                                     "; this program reads version " +
                                                     std::to_string(result_layout::kFormatVersion));
        return {};
    }

    Expected<void> check_digest() {
        std::string stored;
        if (auto read = read_text(result_layout::kDigest, stored); !read) return read;
        const auto digest = scan_result(input_);
        if (!digest) return tl::unexpected(digest.error());
        if (digest->hex() != stored)
            return fail(ErrorCode::kCorrupt, "the content does not match its digest");
        return {};
    }

    Expected<void> read_header() {
        for (const auto& [name, text] :
             {std::pair{"method", &header_.method}, {"job", &header_.job}, {"name", &header_.name}})
            if (auto read = read_text(name, *text); !read) return read;
        const SourceLimits limits;
        struct Count {
            const char* name;
            std::int64_t* value;
            std::int64_t least;
            std::int64_t most;
        };
        for (const Count& count : {Count{"vertex_count", &header_.vertex_count, 1, limits.max_vertices},
                                   Count{"triangle_count", &header_.triangle_count, 0, limits.max_triangles},
                                   Count{"frame_count", &header_.frame_count, 1, limits.max_frames}}) {
            const auto value = number<std::int64_t>(root_.get(), count.name);
            if (!value) return tl::unexpected(value.error());
            if (*value > count.most)
                return fail(ErrorCode::kLimit, std::string(count.name) + " " + std::to_string(*value) +
                                                   " is more than the " + std::to_string(count.most) +
                                                   " allowed");
            if (*value < count.least)
                return fail(ErrorCode::kCorrupt,
                            std::string(count.name) + " " + std::to_string(*value) + " cannot be");
            *count.value = *value;
        }
        const auto fps = number<double>(root_.get(), "fps");
        if (!fps) return tl::unexpected(fps.error());
        header_.fps = *fps;

        const bool has_connectivity = H5Lexists(root_.get(), result_layout::kConnectivity, H5P_DEFAULT) > 0;
        if (has_connectivity != (header_.triangle_count > 0))
            return fail(ErrorCode::kCorrupt,
                        has_connectivity ? "points have a connectivity" : "the connectivity is missing");
        if (!has_connectivity) return {};
        return check_bitstream(result_layout::kConnectivity);
    }

    Expected<void> read_clips() {
        const Handle group(H5Gopen2(root_.get(), result_layout::kClips, H5P_DEFAULT), H5Gclose);
        if (!group) return fail(ErrorCode::kCorrupt, "has no clips");
        const auto names = hdf5::link_names(group.get(), static_cast<std::size_t>(input_.size_bytes));
        if (!names) return tl::unexpected(names.error());
        std::int64_t next_frame = 0;
        for (std::int64_t i = 0; i < static_cast<std::int64_t>(names->size()); ++i) {
            const std::string path = clip_path(i);
            const Handle clip(H5Gopen2(root_.get(), path.c_str(), H5P_DEFAULT), H5Gclose);
            if (!clip) return fail(ErrorCode::kCorrupt, "is missing", path);
            auto first = number<std::int64_t>(clip.get(), "first_frame");
            if (!first) return fail_within(path, std::move(first.error()));
            auto count = number<std::int64_t>(clip.get(), "frame_count");
            if (!count) return fail_within(path, std::move(count.error()));
            if (*first != next_frame || *count < 1 || *count > header_.frame_count - next_frame)
                return fail(ErrorCode::kCorrupt, "does not follow the clip before it", path);
            next_frame += *count;
            clips_.push_back({*first, *count});
            if (auto checked = check_bitstream(path); !checked) return checked;
        }
        if (next_frame != header_.frame_count)
            return fail(ErrorCode::kCorrupt, "the clips have " + std::to_string(next_frame) + " frames of " +
                                                 std::to_string(header_.frame_count));
        return {};
    }

    Expected<void> read_metrics() {
        const Handle group(H5Gopen2(root_.get(), result_layout::kMetrics, H5P_DEFAULT), H5Gclose);
        if (!group) return fail(ErrorCode::kCorrupt, "has no metrics");
        const auto names = hdf5::attribute_names(group.get(), static_cast<std::size_t>(input_.size_bytes));
        if (!names) return tl::unexpected(names.error());
        for (const std::string& name : *names) {
            auto value = number<double>(group.get(), name.c_str());
            if (!value) return fail_within(result_layout::kMetrics, std::move(value.error()));
            metrics_.values[name] = *value;
        }
        for (const auto& [name, values] : {std::pair{"/metrics/frame_rmse", &metrics_.frame_rmse},
                                           {"/metrics/frame_max_error", &metrics_.frame_max_error},
                                           {"/metrics/frame_jump", &metrics_.frame_jump}}) {
            if (values == &metrics_.frame_jump && H5Lexists(group.get(), "frame_jump", H5P_DEFAULT) <= 0)
                continue;  // a result of before jumps were measured
            std::int64_t extent = 0;
            const auto dataset = open_result_dataset(input_, name, ContentKind::kFloat64, extent);
            if (!dataset) return tl::unexpected(dataset.error());
            if (extent != header_.frame_count)
                return fail(ErrorCode::kCorrupt, "does not have a value for every frame", name);
            values->resize(static_cast<std::size_t>(extent));
            if (H5Dread(dataset->get(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values->data()) < 0)
                return fail(ErrorCode::kIo, last_error("reading"), name);
        }
        return {};
    }

    Expected<void> check_bitstream(const std::string& group) const {
        std::int64_t extent = 0;
        const auto dataset = open_result_dataset(input_, group + "/bitstream", ContentKind::kUint8, extent);
        if (!dataset) return tl::unexpected(dataset.error());
        return {};
    }

    Expected<std::vector<std::uint8_t>> read_bitstream(const std::string& group) const {
        hdf5::prepare_thread();
        std::int64_t extent = 0;
        auto dataset = open_result_dataset(input_, group + "/bitstream", ContentKind::kUint8, extent);
        if (!dataset) return fail_within(where_, std::move(dataset.error()));
        try {
            std::vector<std::uint8_t> bytes(static_cast<std::size_t>(extent));
            if (H5Dread(dataset->get(), H5T_NATIVE_UINT8, H5S_ALL, H5S_ALL, H5P_DEFAULT, bytes.data()) < 0)
                return fail(ErrorCode::kIo, last_error("reading"), where_ + ": " + group);
            return bytes;
        } catch (const std::bad_alloc&) {
            return fail(ErrorCode::kOutOfMemory, "no memory for " + std::to_string(extent) + " bytes",
                        where_ + ": " + group);
        }
    }

    std::string where_;
    hdf5::InputFile input_;
    Handle root_;
    ResultHeader header_;
    ResultMetrics metrics_;
    std::vector<ClipSpan> clips_;
};

}  // namespace

Expected<std::unique_ptr<ResultReader>> ResultReader::open(const std::filesystem::path& path) {
    try {
        auto reader = std::make_unique<Hdf5ResultReader>(path.string());
        if (auto opened = reader->open_checked(path); !opened) return tl::unexpected(opened.error());
        return reader;
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::kOutOfMemory, "no memory to open the result", path.string());
    }
}

}  // namespace batchenc
