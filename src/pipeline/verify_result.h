#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/executor.h"

namespace batchenc {

/// One figure of a result: as it was recorded, and as it was found now.
struct VerifiedFigure {
    std::string name;
    double recorded = 0.0;  ///< NaN where results do not record it
    double measured = 0.0;
    bool agrees = false;      ///< within 1e-6 of the larger, both undefined, or not recorded
    bool is_recorded = true;  ///< false of what results do not record, so that there is nothing to agree with
};

struct VerifyReport {
    std::vector<VerifiedFigure> figures;  ///< da, kg, rmse, max_error, max_error_relative, jumps, bits, bpvf;
                                          ///< with triangles also sted, sted_space, sted_time, not recorded
    bool same_triangles = false;          ///< the decoded triangles are the source's, in its order
    bool agrees() const;                  ///< all of the above
};

/// Decodes a result and measures it against its source, a block of frames at a time. The job in the result
/// says which frames and datasets of the source it was made from; a source that has just the result's frames
/// is taken from its first one.
/// memory_bytes: bound on what is allocated. Errors: those of ResultDecoder and SourceClip, kVerification
/// where the shapes do not fit, kInterrupted. That figures differ is no error but stands in the report.
Expected<VerifyReport> verify_result(const std::filesystem::path& result, const std::filesystem::path& source,
                                     std::int64_t memory_bytes, const Executor& executor,
                                     const std::atomic<bool>& stop,
                                     const std::function<void(double)>& progress);

}  // namespace batchenc
