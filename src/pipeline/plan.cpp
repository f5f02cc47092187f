#include "pipeline/plan.h"

#include <algorithm>
#include <map>

#include "io/source_clip.h"
#include "pipeline/clip_cutting.h"
#include "pipeline/guarded.h"

namespace batchenc {

namespace fs = std::filesystem;

namespace {

/// One spelling a file, links resolved as far as the path exists. A path that cannot be looked up keeps its
/// own spelling; opening it will say why.
fs::path canonical_path(const fs::path& path) {
    std::error_code error;
    const fs::path canonical = fs::weakly_canonical(path, error);
    return error ? path.lexically_normal() : canonical;
}

Expected<void> plan_source(JobPlan& plan) {
    const Job& job = plan.job;
    auto source = SourceClip::open(job.input, {job.positions, job.triangles});
    if (!source) return tl::unexpected(source.error());
    const SourceClip& clip = **source;

    const std::int64_t frame_end = job.frame_end.value_or(clip.frame_count());
    if (job.frame_begin < 0 || job.frame_begin >= frame_end || frame_end > clip.frame_count())
        return fail(ErrorCode::kOutOfRange,
                    "the job wants frames [" + std::to_string(job.frame_begin) + ", " +
                        std::to_string(frame_end) + ") of a clip of " + std::to_string(clip.frame_count()),
                    job.input.string());
    if (clip.vertex_count() < 1)
        return fail(ErrorCode::kFormat, "the clip has no vertices", job.input.string());

    plan.header.method = to_name(job.codec.method);
    plan.header.job = job.yaml;
    plan.header.vertex_count = clip.vertex_count();
    plan.header.triangle_count = clip.triangle_count();
    plan.header.frame_count = frame_end - job.frame_begin;
    plan.header.fps = clip.fps();
    plan.header.name = clip.name();
    const std::int64_t frame_count = plan.header.frame_count;
    plan.cuts_by_motion = job.clip_length == kAutomaticClips && has_components(job.codec.method);
    plan.clip_length = frame_count;
    if (job.clip_length > 0) plan.clip_length = std::min(job.clip_length, frame_count);
    if (job.clip_length == kAutomaticClips)
        plan.clip_length =
            std::min(longest_automatic_clip(job.codec.method, clip.vertex_count()), frame_count);
    return {};
}

/// Metrics of the result at `path` if it is whole and the very one that `header` would get.
std::optional<ResultMetrics> matching_result(const fs::path& path, const ResultHeader& header) {
    const auto reader = ResultReader::open(path);
    if (!reader) return std::nullopt;
    const ResultHeader& found = (*reader)->header();
    const bool same = found.job == header.job && found.vertex_count == header.vertex_count &&
                      found.triangle_count == header.triangle_count &&
                      found.frame_count == header.frame_count;
    return same ? std::optional((*reader)->metrics()) : std::nullopt;
}

Expected<void> plan_job(JobPlan& plan, ExistingOutput existing) {
    const fs::path& output = plan.job.output;
    std::error_code ignored;  // a path that cannot be looked up fails with its reason when it is written
    const bool exists = fs::exists(output, ignored);
    if (exists && existing == ExistingOutput::kRefuse)
        return fail(ErrorCode::kExists, "exists; --overwrite replaces it, --resume keeps it if it is whole",
                    output.string());
    if (auto source = plan_source(plan); !source) return source;
    if (exists && existing == ExistingOutput::kResume) plan.kept = matching_result(output, plan.header);
    return {};
}

}  // namespace

std::vector<ClipSpan> JobPlan::even_clips() const {
    std::vector<ClipSpan> clips;
    for (std::int64_t first = 0; first < header.frame_count; first += clip_length)
        clips.push_back({first, std::min(clip_length, header.frame_count - first)});
    return clips;
}

Expected<void> check_outputs(const std::vector<Job>& jobs) {
    std::map<fs::path, const Job*> inputs;
    for (const Job& job : jobs) inputs.emplace(canonical_path(job.input), &job);
    std::map<fs::path, const Job*> outputs;
    for (const Job& job : jobs) {
        const fs::path output = canonical_path(job.output);
        if (const auto [other, is_new] = outputs.emplace(output, &job); !is_new)
            return fail(ErrorCode::kInvalidArgument,
                        "output " + job.output.string() + " is also the output of job " +
                            other->second->name + " (" + other->second->file.string() + ")",
                        job.file.string());
        if (const auto other = inputs.find(output); other != inputs.end())
            return fail(ErrorCode::kInvalidArgument,
                        "output " + job.output.string() + " is the input of job " + other->second->name +
                            " (" + other->second->file.string() + ")",
                        job.file.string());
    }
    return {};
}

std::vector<JobPlan> plan_jobs(const std::vector<Job>& jobs, ExistingOutput existing,
                               const std::atomic<bool>& stop) {
    std::vector<JobPlan> plans(jobs.size());
    for (std::size_t i = 0; i < jobs.size(); ++i) {
        JobPlan& plan = plans[i];
        plan.job = jobs[i];
        plan.overwrite = existing != ExistingOutput::kRefuse;
        const auto planned = guarded(stop, [&] { return plan_job(plan, existing); });
        if (!planned) plan.error = planned.error();
    }
    return plans;
}

std::int64_t clip_memory_bytes(const JobPlan& plan) {
    const std::int64_t vertices = plan.header.vertex_count;
    // Source, decoded, and what segmentation and coding hold at their peak, which is counted as one more copy
    // of the clip. Measured: 2.3 copies (20 clusters, 20000 vertices, 600 frames). Baselines hold points,
    // residuals and symbols of a whole clip at once. Measured: 6.2 copies (baseline-dynapack, 9971 vertices,
    // 175 frames).
    const std::int64_t copies = is_baseline(plan.job.codec.method) ? 7 : 3;
    const std::int64_t clip = copies * 12 * vertices * plan.clip_length;
    // LCFs, seed triangles and coefficients of every cluster over time, and the double-precision copy that
    // the SVD of a cluster makes, of which one a thread lives; with few clusters that is the clip again,
    // twice as wide.
    const std::int64_t wanted = plan.job.segmentation.clusters > 0 ? plan.job.segmentation.clusters
                                                                   : std::int64_t{kMostAutomaticClusters};
    const std::int64_t clusters = std::min(wanted, vertices);
    // Columns of theta, while the decoded clip and the codec's copy are not there yet.
    const std::int64_t theta =
        std::max<std::int64_t>(0, 4 * vertices * clusters - 12 * vertices * plan.clip_length);
    const std::int64_t tables =
        (96 + 8 * std::int64_t{std::min(plan.job.codec.components, 64)}) * clusters * plan.clip_length;
    // ORLPCA keeps the components of all clusters, as they are and quantised.
    const std::int64_t components =
        plan.job.codec.method == CodecMethod::kOrlpca
            ? 2 * 12 * vertices * std::min<std::int64_t>(plan.job.codec.components, plan.clip_length)
            : 0;
    const std::int64_t svd = clusters < 8 ? 2 * 12 * vertices * plan.clip_length : 0;
    // Triangles, and what coding them keeps of each (measured: 236 bytes); of a vertex sums of the error
    // meter, labels, and what all clips derive from the triangles.
    const std::int64_t job = 256 * plan.header.triangle_count + 320 * vertices + 80 * plan.header.frame_count;
    return clip + theta + tables + components + svd + job;
}

int choose_tokens(const std::vector<JobPlan>& plans, std::int64_t memory_bytes, int threads) {
    std::int64_t largest = 1;
    for (const JobPlan& plan : plans)
        if (plan.runs()) largest = std::max(largest, clip_memory_bytes(plan));
    return static_cast<int>(std::clamp<std::int64_t>(memory_bytes / largest, 1, 2LL * threads));
}

}  // namespace batchenc
