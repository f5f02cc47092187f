#include "pipeline/job_run.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "codecs/rtpca.h"
#include "pipeline/clip_cutting.h"
#include "pipeline/guarded.h"
#include "pipeline/vertex_order.h"

namespace batchenc {

namespace {

PositionsView view_of(const std::vector<float>& positions, const ClipSpan& span, std::int64_t vertex_count) {
    return {positions.data(), span.frame_count, vertex_count};
}

MutablePositionsView view_of(std::vector<float>& positions, const ClipSpan& span, std::int64_t vertex_count) {
    positions.resize(static_cast<std::size_t>(3 * span.frame_count * vertex_count));
    return {positions.data(), span.frame_count, vertex_count};
}

/// Root of each vertex' mean squared distance over the frames, world units.
std::vector<float> measure_vertex_rmse(PositionsView source, PositionsView decoded,
                                       const Executor& executor) {
    constexpr std::int64_t kBlock =
        4096;  // vertices whose frames are walked together, a row of 48 KiB a time
    const std::int64_t vertex_count = source.vertex_count();
    std::vector<float> rmse(static_cast<std::size_t>(vertex_count));
    executor.for_each((vertex_count + kBlock - 1) / kBlock, [&](std::int64_t block) {
        const std::int64_t begin = block * kBlock;
        const std::int64_t end = std::min(begin + kBlock, vertex_count);
        std::vector<double> sums(static_cast<std::size_t>(end - begin));
        for (std::int64_t f = 0; f < source.frame_count(); ++f)
            for (std::int64_t v = begin; v < end; ++v) {
                const float* p = source.at(f, v);
                const float* q = decoded.at(f, v);
                for (int axis = 0; axis < 3; ++axis) {
                    const double error = static_cast<double>(p[axis]) - static_cast<double>(q[axis]);
                    sums[static_cast<std::size_t>(v - begin)] += error * error;
                }
            }
        for (std::int64_t v = begin; v < end; ++v)
            rmse[static_cast<std::size_t>(v)] = static_cast<float>(std::sqrt(
                sums[static_cast<std::size_t>(v - begin)] / static_cast<double>(source.frame_count())));
    });
    return rmse;
}

}  // namespace

Expected<void> JobRun::cut(const std::atomic<bool>& stop) {
    const Stopwatch watch;
    if (auto shared = share_target(stop); !shared) return shared;
    cut_time_s_ = watch.seconds();
    if (!plan_.cuts_by_motion) {
        clips_ = plan_.even_clips();
        return {};
    }
    clips_ = {{0, plan_.header.frame_count}};
    auto clips = guarded(stop, [&] { return cut_by_motion(plan_, executor_, stop); });
    cut_time_s_ = watch.seconds();
    if (!clips) return tl::unexpected(clips.error());
    clips_ = std::move(*clips);
    return {};
}

/// Where there may be several clips: what the target of the whole job is to one of them, which does not know
/// the others' bounding boxes and mean positions.
Expected<void> JobRun::share_target(const std::atomic<bool>& stop) {
    if (!plan_.cuts_by_motion && plan_.clip_length == plan_.header.frame_count) return {};
    if (codec_.max_error_relative > 0.0) {
        const auto diagonal = guarded(stop, [&] { return diagonal_of(plan_, executor_, stop); });
        if (!diagonal) return tl::unexpected(diagonal.error());
        codec_.max_error = codec_.max_error_relative * *diagonal;
        codec_.max_error_relative = 0.0;
    }
    if (codec_.target_da > 0.0) {
        // What kg is over adds up over clips; what da is over does not.
        const auto factor = guarded(stop, [&] { return kg_over_da(plan_, executor_, stop); });
        if (!factor) return tl::unexpected(factor.error());
        if (*factor > 0.0) {
            codec_.target_kg = codec_.target_da * *factor;
            codec_.target_da = 0.0;
        }
    }
    return {};
}

/// Leaves the clips what a target in size leaves after the connectivity.
Expected<void> JobRun::take_connectivity_off_target() {
    const double taken =
        8.0 * static_cast<double>(connectivity_.bytes.size()) /
        (static_cast<double>(plan_.header.vertex_count) * static_cast<double>(plan_.header.frame_count));
    if (codec_.target_bpvf <= taken)
        return fail(
            ErrorCode::kInvalidArgument,
            "codec.target.bpvf is beyond reach: the connectivity alone takes " + std::to_string(taken));
    codec_.target_bpvf -= taken;
    return {};
}

Expected<void> JobRun::open() {
    since_first_read_ = Stopwatch();
    const Job& job = plan_.job;
    const ResultHeader& header = plan_.header;

    auto source = SourceClip::open(job.input, {job.positions, job.triangles});
    if (!source) return tl::unexpected(source.error());
    source_ = std::move(*source);
    if (source_->vertex_count() != header.vertex_count ||
        source_->triangle_count() != header.triangle_count ||
        source_->frame_count() < job.frame_begin + header.frame_count)
        return fail(ErrorCode::kIo, "the clip changed its shape since the batch was planned",
                    job.input.string());

    // The result is begun before the work, so that a place that cannot be written costs no encoding.
    auto writer = ResultWriter::create(job.output, header, plan_.overwrite);
    if (!writer) return tl::unexpected(writer.error());
    writer_ = std::move(*writer);
    meter_.emplace(header.vertex_count);

    if (header.triangle_count == 0) {
        mesh_ = std::make_shared<const MeshTopology>(std::vector<Triangle>(), header.vertex_count);
        return {};
    }
    auto triangles = source_->read_triangles();
    if (!triangles) return tl::unexpected(triangles.error());
    mesh_ = std::make_shared<const MeshTopology>(std::move(*triangles), header.vertex_count);
    const bool has_size = codec_.target_bpvf > 0.0;
    if (job.order == MeshOrder::kPreserve && !has_size) return {};
    if (auto coded = code_connectivity(); !coded) return coded;
    if (job.order == MeshOrder::kFree) {  // that of the coded connectivity, and everything after goes by it
        mesh_ = std::make_shared<const MeshTopology>(std::move(connectivity_.triangles), header.vertex_count);
        source_vertices_ = std::move(connectivity_.source_vertices);
    }
    return has_size ? take_connectivity_off_target() : Expected<void>{};
}

Expected<void> JobRun::code_connectivity() {
    if (mesh_->is_points() || !connectivity_.bytes.empty()) return {};
    auto connectivity =
        write_connectivity_bitstream(mesh_->triangles(), plan_.header.vertex_count, plan_.job.order);
    if (!connectivity) return tl::unexpected(connectivity.error());
    connectivity_ = std::move(*connectivity);
    return {};
}

Expected<void> JobRun::verify_connectivity() const {
    if (mesh_->is_points()) return {};
    const auto decoded = read_connectivity_bitstream(connectivity_.bytes, plan_.header.vertex_count,
                                                     plan_.header.triangle_count);
    if (!decoded) return fail_within("decoding the connectivity just coded", decoded.error());
    if (*decoded != mesh_->triangles())
        return fail(ErrorCode::kVerification, "the decoded connectivity differs from the source's");
    return {};
}

Expected<void> JobRun::read(ClipInFlight& clip) {
    if (clip.index == 0)
        if (auto opened = open(); !opened) return opened;
    const MutablePositionsView frames = view_of(clip.source, clip.span, plan_.header.vertex_count);
    if (auto read = source_->read_frames(plan_.job.frame_begin + clip.span.first_frame, frames, executor_);
        !read)
        return read;
    reorder_vertices(frames, source_vertices_, executor_);
    return {};
}

Expected<void> JobRun::segment(ClipInFlight& clip) {
    if (!uses_clusters(plan_.job.codec.method)) return {};
    const PositionsView source = view_of(std::as_const(clip.source), clip.span, plan_.header.vertex_count);
    const SegmentationParameters& asked = plan_.job.segmentation;
    auto segmentation = counts_clusters(codec_.method) && asked.clusters == 0
                            ? segment_for_rtpca(source, *mesh_, asked, codec_, executor_)
                            : segment_clip(source, mesh_->triangles(), asked, executor_);
    if (!segmentation) return tl::unexpected(segmentation.error());
    clip.segmentation = std::move(*segmentation);
    return {};
}

Expected<void> JobRun::code(ClipInFlight& clip) {
    const PositionsView source = view_of(std::as_const(clip.source), clip.span, plan_.header.vertex_count);
    // The connectivity is coded once, beside the first clip.
    Expected<void> connectivity;
    Expected<EncodedClip> encoded;
    executor_.for_each(clip.index == 0 ? 2 : 1, [&](std::int64_t task) {
        if (task == 0)
            encoded = encode_clip(source, *mesh_, clip.segmentation, codec_, executor_);
        else
            connectivity = code_connectivity();
    });
    if (!encoded) return tl::unexpected(encoded.error());
    clip.encoded = std::move(*encoded);
    return connectivity;
}

Expected<void> JobRun::verify(ClipInFlight& clip) {
    Expected<void> positions, connectivity;
    executor_.for_each(clip.index == 0 ? 2 : 1, [&](std::int64_t task) {
        if (task == 0)
            positions = verify_positions(clip);
        else
            connectivity = verify_connectivity();
    });
    return positions ? connectivity : positions;
}

Expected<void> JobRun::verify_positions(ClipInFlight& clip) {
    constexpr std::int64_t kNoLimit = std::numeric_limits<std::int64_t>::max();  // these bytes are our own
    const Stopwatch watch;
    auto decoder = decode_clip(clip.encoded.bitstream, mesh_, -1, kNoLimit, executor_);
    if (!decoder) return fail_within("decoding what was just coded", decoder.error());
    const MutablePositionsView decoded = view_of(clip.decoded, clip.span, plan_.header.vertex_count);
    if (auto done = (*decoder)->reconstruct(0, decoded, executor_); !done)
        return fail_within("decoding what was just coded", done.error());
    clip.decode_time_s = watch.seconds();

    if (plan_.job.analysis) {
        const PositionsView source =
            view_of(std::as_const(clip.source), clip.span, plan_.header.vertex_count);
        clip.labels = (*decoder)->labels();
        if (clip.labels.empty()) clip.segmentation.cluster_deviations.clear();  // the coder took no clusters
        clip.vertex_rmse = measure_vertex_rmse(source, decoded, executor_);
    }
    return {};
}

Expected<void> JobRun::write(ClipInFlight& clip) {
    // Here and not in verify, because the sums over a job's clips come out alike only in their order.
    const std::int64_t vertex_count = plan_.header.vertex_count;
    meter_->add(view_of(std::as_const(clip.source), clip.span, vertex_count),
                view_of(std::as_const(clip.decoded), clip.span, vertex_count), executor_);
    if (clip.index == 0 && !connectivity_.bytes.empty()) {
        if (auto done = writer_->write_connectivity(connectivity_.bytes); !done) return done;
        bytes_.connectivity = static_cast<std::int64_t>(connectivity_.bytes.size());
        bytes_.order = connectivity_.order_bytes;
    }
    if (auto done = writer_->write_clip(clip.span, clip.encoded.bitstream); !done) return done;
    if (plan_.job.analysis)
        if (auto done = writer_->write_analysis(
                {clip.labels, clip.vertex_rmse, clip.segmentation.cluster_deviations});
            !done)
            return done;
    bytes_.clips += clip.encoded.section_bytes;
    decode_time_s_ += clip.decode_time_s;
    return clip.index + 1 == static_cast<std::int64_t>(clips_.size()) ? finish() : Expected<void>{};
}

/// Whether the result keeps the job's target.
Expected<void> JobRun::check_target() const {
    constexpr double kRounding = 1.0 + 1e-9;  // of sums over clips
    const CodecParameters& asked = plan_.job.codec;
    for (const CodecTarget target : {CodecTarget::kKg, CodecTarget::kDa, CodecTarget::kBpvf}) {
        const double most = value_of(asked, target);
        const std::string name(to_name(target));
        const double reached = metrics_.values.at(name);
        if (most > 0.0 && !(reached <= most * kRounding))
            return fail(ErrorCode::kVerification, name + " is " + std::to_string(reached) +
                                                      ", above its target " + std::to_string(most));
    }
    return {};
}

Expected<void> JobRun::finish() {
    // encode_time_s: finding the cuts, and from the first clip's read to the last clip's write, other jobs'
    // clips in between included. decode_time_s: entropy decoding and reconstruction of all clips, each clip's
    // own wall time.
    const ErrorMetrics errors = meter_->finish();
    if (!std::isfinite(errors.rmse))
        return fail(ErrorCode::kVerification, "the decoded clip holds NaN or Inf");
    metrics_ =
        make_result_metrics(bytes_, errors, clips_, plan_.header.vertex_count, plan_.header.frame_count,
                            cut_time_s_ + since_first_read_.seconds(), decode_time_s_);
    if (auto kept = check_target(); !kept) return kept;
    return writer_->finish(metrics_);
}

void JobRun::record_failure(Error error) {
    const std::lock_guard lock(error_mutex_);
    if (!error_) error_ = std::move(error);
    failed_.store(true, std::memory_order_release);
}

JobReport JobRun::close() {
    writer_.reset();
    source_.reset();
    meter_.reset();
    mesh_.reset();

    JobReport report;
    report.name = plan_.job.name;
    report.output = plan_.job.output;
    report.error = error_;
    report.raw_bytes = plan_.raw_bytes();
    report.seconds = seconds_;
    if (!error_) {
        report.metrics = std::move(metrics_);
        std::error_code ignored;  // only a figure for the report
        const auto size = std::filesystem::file_size(plan_.job.output, ignored);
        report.result_bytes = ignored ? 0 : static_cast<std::int64_t>(size);
    }
    return report;
}

}  // namespace batchenc
