#pragma once

#include <atomic>
#include <vector>

#include "core/executor.h"
#include "pipeline/plan.h"

namespace batchenc {

/// Frames of the longest clip that `clips.length: auto` makes: 4096, or what keeps a clip's positions at 192
/// MiB, but at least 32. Without cuts by motion all clips are that long; where every frame is coded by
/// itself, 32 MiB are enough. The same for any --memory, so that the cuts are.
std::int64_t longest_automatic_clip(CodecMethod method, std::int64_t vertex_count);

/// Reads the frames of the job a block at a time and cuts them where their motion changes
/// (kernels/clip_cuts.h), in the job's frames, without gaps.
/// plan: one that runs, with cuts_by_motion. Errors: those of SourceClip; kInterrupted.
Expected<std::vector<ClipSpan>> cut_by_motion(const JobPlan& plan, const Executor& executor,
                                              const std::atomic<bool>& stop);

/// kg of the whole job over its da, which no error changes; 0 where one of them is not defined. Reads the
/// frames a block at a time. Errors as above.
Expected<double> kg_over_da(const JobPlan& plan, const Executor& executor, const std::atomic<bool>& stop);

/// The diagonal of the bounding box of all frames of the job, world units; reads them a block at a time.
/// Errors as above.
Expected<double> diagonal_of(const JobPlan& plan, const Executor& executor, const std::atomic<bool>& stop);

}  // namespace batchenc
