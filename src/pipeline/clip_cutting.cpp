#include "pipeline/clip_cutting.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "io/source_clip.h"
#include "kernels/bounding_box.h"
#include "kernels/clip_cuts.h"
#include "kernels/error_metrics.h"
#include "pipeline/guarded.h"

namespace batchenc {

namespace {

constexpr std::int64_t kBlockBytes = 16 << 20;  // of frames that are read together

/// What a cut costs the job's coder, and what coding frames together saves it.
ClipCutModel model_of(const JobPlan& plan) {
    ClipCutModel model;
    model.longest = plan.clip_length;
    return model;
}

/// Reads the frames of a job a block at a time.
template <typename Visit>
Expected<void> visit_frames(const JobPlan& plan, const Executor& executor, const std::atomic<bool>& stop,
                            Visit visit) {
    const Job& job = plan.job;
    auto source = SourceClip::open(job.input, {job.positions, job.triangles});
    if (!source) return tl::unexpected(source.error());
    const std::int64_t vertex_count = plan.header.vertex_count, frame_count = plan.header.frame_count;
    if ((*source)->vertex_count() != vertex_count || (*source)->frame_count() < job.frame_begin + frame_count)
        return fail(ErrorCode::kIo, "the clip changed its shape since the batch was planned",
                    job.input.string());
    const std::int64_t block_frames = std::max<std::int64_t>(1, kBlockBytes / (12 * vertex_count));
    std::vector<float> block;
    for (std::int64_t first = 0; first < frame_count; first += block_frames) {
        if (stop.load(std::memory_order_relaxed)) throw Interrupted{};
        const std::int64_t count = std::min(block_frames, frame_count - first);
        block.resize(static_cast<std::size_t>(3 * count * vertex_count));
        const MutablePositionsView frames(block.data(), count, vertex_count);
        if (auto read = (*source)->read_frames(job.frame_begin + first, frames, executor); !read) return read;
        visit(frames);
    }
    return {};
}

}  // namespace

std::int64_t longest_automatic_clip(CodecMethod method, std::int64_t vertex_count) {
    constexpr std::int64_t kMostFrames = 4096, kFewestFrames = 32, kMostBytes = 192 << 20;
    constexpr std::int64_t kMostBytesByFrames = 32 << 20;
    return uses_clusters(method)
               ? std::clamp(kMostBytes / (12 * vertex_count), kFewestFrames, kMostFrames)
               : std::clamp(kMostBytesByFrames / (12 * vertex_count), std::int64_t{1}, kMostFrames);
}

Expected<std::vector<ClipSpan>> cut_by_motion(const JobPlan& plan, const Executor& executor,
                                              const std::atomic<bool>& stop) {
    ClipCutter cutter(plan.header.vertex_count, model_of(plan));
    const auto read = visit_frames(plan, executor, stop,
                                   [&](MutablePositionsView frames) { cutter.add(frames, executor); });
    if (!read) return tl::unexpected(read.error());
    std::vector<ClipSpan> clips;
    std::int64_t first = 0;
    for (const std::int64_t length : cutter.finish(executor)) {
        clips.push_back({first, length});
        first += length;
    }
    return clips;
}

Expected<double> kg_over_da(const JobPlan& plan, const Executor& executor, const std::atomic<bool>& stop) {
    ErrorMeter meter(plan.header.vertex_count);
    const auto read = visit_frames(plan, executor, stop,
                                   [&](MutablePositionsView frames) { meter.add(frames, frames, executor); });
    if (!read) return tl::unexpected(read.error());
    const ErrorMetrics metrics = meter.finish();
    return metrics.da_spread > 0.0 && metrics.kg_spread > 0.0
               ? std::sqrt(metrics.da_spread / metrics.kg_spread)
               : 0.0;
}

Expected<double> diagonal_of(const JobPlan& plan, const Executor& executor, const std::atomic<bool>& stop) {
    std::optional<BoundingBox> whole;
    const auto read = visit_frames(plan, executor, stop, [&](MutablePositionsView frames) {
        const BoundingBox box = bounding_box(frames);
        if (!whole) whole = box;
        for (std::size_t c = 0; c < 3; ++c) {
            whole->low[c] = std::min(whole->low[c], box.low[c]);
            whole->high[c] = std::max(whole->high[c], box.high[c]);
        }
    });
    if (!read) return tl::unexpected(read.error());
    return whole->diagonal();
}

}  // namespace batchenc
