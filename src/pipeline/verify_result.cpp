#include "pipeline/verify_result.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "codecs/connectivity_bitstream.h"
#include "io/job_file.h"
#include "io/source_clip.h"
#include "kernels/edge_distortion.h"
#include "kernels/error_metrics.h"
#include "pipeline/guarded.h"
#include "pipeline/result_decoder.h"
#include "pipeline/result_metrics.h"
#include "pipeline/vertex_order.h"

namespace batchenc {

namespace {

constexpr double kTolerance = 1e-6;  // of the larger of two figures

/// Two NaN agree, because da, kg and the relative error are undefined for some clips; an infinity agrees with
/// nothing.
bool nearly_equal(double a, double b) {
    if (std::isnan(a) || std::isnan(b)) return std::isnan(a) && std::isnan(b);
    if (std::isinf(a) || std::isinf(b)) return false;
    return std::abs(a - b) <= kTolerance * std::max(std::abs(a), std::abs(b));
}

/// The job that stands in a result. Only its names and its frame range are used, no path of it is opened.
Expected<Job> recorded_job(const ResultHeader& header, const std::filesystem::path& result) {
    auto jobs = parse_job(header.job, result);
    if (!jobs) return fail_within("the job in the result", jobs.error());
    if (jobs->size() != 1)
        return fail(ErrorCode::kCorrupt, "the job in the result is a sweep", result.string());
    return std::move(jobs->front());
}

/// First frame of the source that the result holds.
Expected<std::int64_t> first_source_frame(const SourceClip& source, const ResultHeader& header,
                                          const Job& job, const std::filesystem::path& path) {
    if (source.vertex_count() != header.vertex_count)
        return fail(ErrorCode::kVerification,
                    "has " + std::to_string(source.vertex_count()) + " vertices, the result " +
                        std::to_string(header.vertex_count),
                    path.string());
    if (source.frame_count() == header.frame_count) return 0;
    if (source.frame_count() - header.frame_count < job.frame_begin)
        return fail(ErrorCode::kVerification,
                    "has " + std::to_string(source.frame_count()) + " frames, the result holds " +
                        std::to_string(header.frame_count) + " from frame " + std::to_string(job.frame_begin),
                    path.string());
    return job.frame_begin;
}

/// Bits of all bitstreams, counted afresh.
Expected<double> count_bits(ResultReader& reader) {
    const auto connectivity = reader.read_connectivity();
    if (!connectivity) return tl::unexpected(connectivity.error());
    std::size_t bytes = connectivity->size();
    for (std::size_t i = 0; i < reader.clips().size(); ++i) {
        const auto clip = reader.read_clip(static_cast<std::int64_t>(i));
        if (!clip) return tl::unexpected(clip.error());
        bytes += clip->size();
    }
    return 8.0 * static_cast<double>(bytes);
}

Expected<VerifyReport> verify(const std::filesystem::path& result, const std::filesystem::path& source_path,
                              std::int64_t memory_bytes, const Executor& executor,
                              const std::atomic<bool>& stop, const std::function<void(double)>& progress) {
    auto decoder = ResultDecoder::open(result, memory_bytes);
    if (!decoder) return tl::unexpected(decoder.error());
    const ResultHeader& header = decoder->reader().header();
    const auto job = recorded_job(header, result);
    if (!job) return tl::unexpected(job.error());
    auto source = SourceClip::open(source_path, {job->positions, job->triangles});
    if (!source) return tl::unexpected(source.error());
    const auto offset = first_source_frame(**source, header, *job, source_path);
    if (!offset) return tl::unexpected(offset.error());

    VerifyReport report;
    auto triangles = (*source)->read_triangles();
    if (!triangles) return tl::unexpected(triangles.error());
    std::vector<std::int32_t> source_vertices;
    if (job->order == MeshOrder::kFree && !triangles->empty()) {  // the order is that of coding it again
        auto coded = write_connectivity_bitstream(*triangles, header.vertex_count, job->order);
        if (!coded) return tl::unexpected(coded.error());
        *triangles = std::move(coded->triangles);
        source_vertices = std::move(coded->source_vertices);
    }
    report.same_triangles = *triangles == decoder->triangles();

    ErrorMeter meter(header.vertex_count);
    std::optional<EdgeDistortionMeter> edges;
    if (!decoder->triangles().empty()) edges.emplace(decoder->triangles(), header.vertex_count);
    std::vector<float> frames;
    const auto measure = [&](std::int64_t first, PositionsView decoded) -> Expected<void> {
        if (stop.load(std::memory_order_relaxed)) throw Interrupted{};
        frames.resize(static_cast<std::size_t>(decoded.value_count()));
        const MutablePositionsView original(frames.data(), decoded.frame_count(), decoded.vertex_count());
        if (auto read = (*source)->read_frames(*offset + first, original); !read) return read;
        reorder_vertices(original, source_vertices, executor);
        meter.add(original, decoded, executor);
        if (edges) edges->add(original, decoded, executor);
        progress(static_cast<double>(first + decoded.frame_count()) /
                 static_cast<double>(header.frame_count));
        return {};
    };
    if (auto done = decoder->decode_frames(0, header.frame_count, -1, executor, measure); !done)
        return tl::unexpected(done.error());
    const auto bits = count_bits(decoder->reader());
    if (!bits) return tl::unexpected(bits.error());

    const ErrorMetrics errors = meter.finish();
    if (!std::isfinite(errors.rmse))
        return fail(ErrorCode::kVerification, "the decoded clip holds NaN or Inf", result.string());
    const auto& recorded = decoder->reader().metrics().values;
    const auto compare = [&](const char* name, double measured) {
        const auto found = recorded.find(name);
        const double value =
            found == recorded.end() ? std::numeric_limits<double>::quiet_NaN() : found->second;
        const bool agrees = found != recorded.end() && nearly_equal(value, measured);
        report.figures.push_back({name, value, measured, agrees, true});
    };
    compare("da", errors.da);
    compare("kg", errors.kg);
    compare("rmse", errors.rmse);
    compare("max_error", errors.max_error);
    compare("max_error_relative", errors.max_error_relative);
    if (recorded.contains("seam_jump_max")) {  // results of before jumps were measured have none
        const SeamJumps jumps = find_seam_jumps(errors.frame_jump, decoder->reader().clips());
        compare("seam_jump_max", jumps.seam_max);
        compare("seam_jump_mean", jumps.seam_mean);
        compare("inner_jump_max", jumps.inner_max);
        compare("inner_jump_mean", jumps.inner_mean);
    }
    if (edges) {
        const EdgeDistortion distortion = edges->finish();
        const auto show = [&](const char* name, double measured) {
            report.figures.push_back({name, std::numeric_limits<double>::quiet_NaN(), measured, true, false});
        };
        show("sted", distortion.total);
        show("sted_space", distortion.space);
        show("sted_time", distortion.time);
    }
    compare("bits_total", *bits);
    compare("bpvf",
            *bits / (static_cast<double>(header.vertex_count) * static_cast<double>(header.frame_count)));
    return report;
}

}  // namespace

bool VerifyReport::agrees() const {
    return same_triangles && std::all_of(figures.begin(), figures.end(),
                                         [](const VerifiedFigure& figure) { return figure.agrees; });
}

Expected<VerifyReport> verify_result(const std::filesystem::path& result, const std::filesystem::path& source,
                                     std::int64_t memory_bytes, const Executor& executor,
                                     const std::atomic<bool>& stop,
                                     const std::function<void(double)>& progress) {
    return guarded(stop, [&] { return verify(result, source, memory_bytes, executor, stop, progress); });
}

}  // namespace batchenc
