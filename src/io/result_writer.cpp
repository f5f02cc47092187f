#include <algorithm>
#include <new>
#include <utility>

#include "io/hdf5/durable_file.h"
#include "io/hdf5/hdf5_handle.h"
#include "io/hdf5/result_digest.h"
#include "io/hdf5/result_layout.h"
#include "io/hdf5/result_scan.h"
#include "io/result_file.h"

namespace batchenc {

namespace {

using hdf5::Handle;
using hdf5::last_error;

/// Every object is hashed from the caller's memory as it is handed to HDF5. What finish() reads back from the
/// closed file has to give the same digest, byte for byte, or nothing appears under the name.
class Hdf5ResultWriter final : public ResultWriter {
 public:
    Hdf5ResultWriter(DurableFile target, const ResultHeader& header)
        : target_(std::move(target)), where_(target_.path().string()), header_(header) {}

    Expected<void> begin() {
        auto file = hdf5::create_output(target_.temporary_path());
        if (!file) return tl::unexpected(file.error());
        file_ = std::move(*file);
        const hid_t root = file_.get();
        for (auto done :
             {attribute(root, "/", "format", std::string(result_layout::kFormatName)),
              attribute(root, "/", "format_version", result_layout::kFormatVersion),
              attribute(root, "/", "method", header_.method), attribute(root, "/", "job", header_.job),
              attribute(root, "/", "name", header_.name),
              attribute(root, "/", "vertex_count", header_.vertex_count),
              attribute(root, "/", "triangle_count", header_.triangle_count),
              attribute(root, "/", "frame_count", header_.frame_count),
              attribute(root, "/", "fps", header_.fps)})
            if (!done) return done;
        auto clips = create_group(result_layout::kClips);
        if (!clips) return tl::unexpected(clips.error());
        return close_group(*clips);
    }

    Expected<void> write_connectivity(std::span<const std::uint8_t> bitstream) override {
        return guarded([&]() -> Expected<void> {
            if (header_.triangle_count == 0 || has_connectivity_)
                return fail(ErrorCode::kInvalidArgument, "has no place for this connectivity", where_);
            auto group = create_group(result_layout::kConnectivity);
            if (!group) return tl::unexpected(group.error());
            if (auto written = write_bitstream(*group, result_layout::kConnectivity, bitstream); !written)
                return written;
            has_connectivity_ = true;
            return close_group(*group);
        });
    }

    Expected<void> write_clip(const ClipSpan& span, std::span<const std::uint8_t> bitstream) override {
        return guarded([&]() -> Expected<void> {
            if (span.first_frame != next_frame_ || span.frame_count < 1 ||
                span.frame_count > header_.frame_count - next_frame_)
                return fail(ErrorCode::kInvalidArgument,
                            "clip of frames " + std::to_string(span.first_frame) + " + " +
                                std::to_string(span.frame_count) + " does not follow frame " +
                                std::to_string(next_frame_),
                            where_);
            const std::string path =
                std::string(result_layout::kClips) + "/" + result_layout::clip_name(clip_count_);
            auto group = create_group(path);
            if (!group) return tl::unexpected(group.error());
            for (auto done : {attribute(group->get(), path, "first_frame", span.first_frame),
                              attribute(group->get(), path, "frame_count", span.frame_count),
                              write_bitstream(*group, path, bitstream)})
                if (!done) return done;
            next_frame_ += span.frame_count;
            ++clip_count_;
            return close_group(*group);
        });
    }

    Expected<void> write_analysis(const ClipAnalysis& analysis) override {
        return guarded([&]() -> Expected<void> {
            const auto vertex_count = static_cast<std::size_t>(header_.vertex_count);
            if (clip_count_ == analysed_count_ || analysis.vertex_rmse.size() != vertex_count ||
                analysis.labels.size() != (analysis.cluster_deviation.empty() ? 0 : vertex_count))
                return fail(ErrorCode::kInvalidArgument, "has no place for this analysis", where_);
            if (!has_analysis_) {
                auto parent = create_group(result_layout::kAnalysis);
                if (!parent) return tl::unexpected(parent.error());
                if (auto closed = close_group(*parent); !closed) return closed;
                has_analysis_ = true;
            }
            const std::string path =
                std::string(result_layout::kAnalysis) + "/" + result_layout::clip_name(clip_count_ - 1);
            auto group = create_group(path);
            if (!group) return tl::unexpected(group.error());
            if (auto done = dataset(*group, path, "vertex_rmse", ContentKind::kFloat32, analysis.vertex_rmse);
                !done)
                return done;
            if (!analysis.labels.empty()) {
                for (auto done : {dataset(*group, path, "labels", ContentKind::kInt32, analysis.labels),
                                  dataset(*group, path, "cluster_deviation", ContentKind::kFloat64,
                                          analysis.cluster_deviation)})
                    if (!done) return done;
            }
            analysed_count_ = clip_count_;
            return close_group(*group);
        });
    }

    Expected<void> finish(const ResultMetrics& metrics) override {
        return guarded([&]() -> Expected<void> {
            if (next_frame_ != header_.frame_count)
                return fail(ErrorCode::kInvalidArgument,
                            "only " + std::to_string(next_frame_) + " of " +
                                std::to_string(header_.frame_count) + " frames were written",
                            where_);
            if (has_connectivity_ != (header_.triangle_count > 0))
                return fail(ErrorCode::kInvalidArgument, "the connectivity was not written", where_);
            if (auto written = write_metrics(metrics); !written) return written;
            const std::string digest = digest_.hex();
            if (auto written = hdf5::write_attribute(file_.get(), result_layout::kDigest, digest); !written)
                return fail_within(where_, std::move(written.error()));
            if (auto closed = hdf5::close_output(file_, where_); !closed) return closed;
            if (auto verified = verify(digest); !verified) return verified;
            if (auto committed = target_.commit(); !committed) return committed;
            over_ = true;
            return {};
        });
    }

 private:
    /// Runs one step. A step that fails leaves a file that cannot be mended: it is removed at once, and every
    /// later step fails, too.
    template <typename Step>
    Expected<void> guarded(const Step& step) {
        hdf5::prepare_thread();
        if (over_) return fail(ErrorCode::kInvalidArgument, "is finished or has failed before", where_);
        Expected<void> done;
        try {
            done = step();
        } catch (const std::bad_alloc&) {
            done = fail(ErrorCode::kOutOfMemory, "no memory to write the result", where_);
        }
        if (!done) {
            over_ = true;
            file_.close();
            target_.discard();
        }
        return done;
    }

    Expected<Handle> create_group(const std::string& path) {
        auto group = hdf5::create_group(file_.get(), path.c_str());
        if (!group) return fail(group.error().code, group.error().message, where_);
        digest_.add(path, ContentHash(ContentKind::kGroup));
        return group;
    }

    Expected<void> close_group(Handle& group) const {
        if (!group.close()) return fail(ErrorCode::kIo, last_error("closing a group"), where_);
        return {};
    }

    template <typename Value>
    Expected<void> attribute(hid_t object, const std::string& path, const char* name, const Value& value) {
        if (auto written = hdf5::write_attribute(object, name, value); !written)
            return fail_within(where_, std::move(written.error()));
        const std::string key = ResultDigest::attribute_key(path, name);
        if constexpr (std::is_same_v<Value, std::string>) {
            ContentHash hash(ContentKind::kString);
            digest_.add(key, hash.update(value.c_str(), std::max<std::size_t>(value.size(), 1)));
        } else {
            ContentHash hash(std::is_same_v<Value, double> ? ContentKind::kFloat64 : ContentKind::kInt64);
            digest_.add(key, hash.update(&value, sizeof(value)));
        }
        return {};
    }

    template <typename Value>
    Expected<void> dataset(const Handle& group, const std::string& path, const char* name, ContentKind kind,
                           std::span<const Value> values) {
        const hid_t file_type = kind == ContentKind::kUint8     ? H5T_STD_U8LE
                                : kind == ContentKind::kInt32   ? H5T_STD_I32LE
                                : kind == ContentKind::kFloat32 ? H5T_IEEE_F32LE
                                                                : H5T_IEEE_F64LE;
        // The memory is little-endian (result_digest.cpp insists), so that file and memory have one type.
        if (auto written =
                hdf5::write_vector(group.get(), name, file_type, file_type, values.data(), values.size());
            !written)
            return fail_within(where_ + ": " + path, std::move(written.error()));
        ContentHash hash(kind, static_cast<std::int64_t>(values.size()));
        digest_.add(path + "/" + name, hash.update(values.data(), values.size_bytes()));
        return {};
    }

    Expected<void> write_bitstream(const Handle& group, const std::string& path,
                                   std::span<const std::uint8_t> bitstream) {
        if (bitstream.empty())
            return fail(ErrorCode::kInvalidArgument, "an empty bitstream cannot be", where_ + ": " + path);
        return dataset(group, path, "bitstream", ContentKind::kUint8, bitstream);
    }

    Expected<void> write_metrics(const ResultMetrics& metrics) {
        const auto frame_count = static_cast<std::size_t>(header_.frame_count);
        if (metrics.frame_rmse.size() != frame_count || metrics.frame_max_error.size() != frame_count ||
            (metrics.frame_jump.size() != frame_count && !metrics.frame_jump.empty()))
            return fail(ErrorCode::kInvalidArgument, "the metrics do not have a value for every frame",
                        where_);
        const std::string path = result_layout::kMetrics;
        auto group = create_group(path);
        if (!group) return tl::unexpected(group.error());
        for (const auto& [name, value] : metrics.values)
            if (auto done = attribute(group->get(), path, name.c_str(), value); !done) return done;
        for (const auto& [name, values] : {std::pair{"frame_rmse", &metrics.frame_rmse},
                                           {"frame_max_error", &metrics.frame_max_error},
                                           {"frame_jump", &metrics.frame_jump}}) {
            if (values->empty()) continue;
            if (auto done = dataset(*group, path, name, ContentKind::kFloat64, std::span(*values)); !done)
                return done;
        }
        return close_group(*group);
    }

    /// Opening as a user would checks the layout, and every byte against the digest in the file; which has to
    /// be the one of the bytes that were handed over.
    Expected<void> verify(const std::string& digest) const {
        const auto fault = [&](const std::string& cause) {
            return fail(ErrorCode::kIo, "what was written does not read back: " + cause, where_);
        };
        if (const auto reader = ResultReader::open(target_.temporary_path()); !reader)
            return fault(reader.error().message);
        const auto input = hdf5::open_input(target_.temporary_path());
        if (!input) return fault(input.error().message);
        const Handle root(H5Gopen2(input->file.get(), "/", H5P_DEFAULT), H5Gclose);
        if (!root) return fault(last_error("opening the root group"));
        const auto stored =
            read_result_attribute(*input, root.get(), result_layout::kDigest, ContentKind::kString);
        if (!stored) return fault(stored.error().message);
        if (*stored != digest) return fault("the content differs");
        return {};
    }

    DurableFile target_;  // first, so that the file is closed before it is removed
    std::string where_;
    ResultHeader header_;
    Handle file_;
    ResultDigest digest_;
    std::int64_t clip_count_ = 0;
    std::int64_t analysed_count_ = 0;  ///< number of the last clip with an analysis, plus one
    std::int64_t next_frame_ = 0;
    bool has_connectivity_ = false;
    bool has_analysis_ = false;
    bool over_ = false;
};

Expected<void> check_header(const ResultHeader& header, const std::string& where) {
    if (header.vertex_count < 1 || header.frame_count < 1 || header.triangle_count < 0)
        return fail(ErrorCode::kInvalidArgument, "no result has such counts", where);
    return {};
}

}  // namespace

Expected<std::unique_ptr<ResultWriter>> ResultWriter::create(const std::filesystem::path& path,
                                                             const ResultHeader& header, bool overwrite) {
    if (auto checked = check_header(header, path.string()); !checked) return tl::unexpected(checked.error());
    try {
        std::error_code error;
        if (path.has_parent_path()) std::filesystem::create_directories(path.parent_path(), error);
        if (error) return fail(ErrorCode::kIo, "cannot make its folder: " + error.message(), path.string());
        auto target = DurableFile::create(path, overwrite);
        if (!target) return tl::unexpected(target.error());
        auto writer = std::make_unique<Hdf5ResultWriter>(std::move(*target), header);
        if (auto begun = writer->begin(); !begun) return tl::unexpected(begun.error());
        return writer;
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::kOutOfMemory, "no memory to write the result", path.string());
    }
}

}  // namespace batchenc
