#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/error.h"

namespace batchenc {

/// What stands in the root attributes of a result (docs/RESULTS.md).
struct ResultHeader {
    std::string method;  ///< codec method as in the job
    std::string job;     ///< the job that made it, as YAML
    std::int64_t vertex_count = 0;
    std::int64_t triangle_count = 0;
    std::int64_t frame_count = 0;
    double fps = 0.0;
    std::string name;
};

/// Where one clip lies in the sequence.
struct ClipSpan {
    std::int64_t first_frame = 0;
    std::int64_t frame_count = 0;
};

/// What goes into /metrics: attributes by name, and arrays of F values.
struct ResultMetrics {
    std::map<std::string, double> values;  ///< "bpvf", "da", "bits_total", …; all names in docs/RESULTS.md
    std::vector<double> frame_rmse;        ///< F values, world units
    std::vector<double> frame_max_error;   ///< F values, world units
    std::vector<double> frame_jump;  ///< F values, world units; none in results of before it was measured
};

/// What goes into /analysis for one clip.
struct ClipAnalysis {
    std::span<const std::int32_t> labels;  ///< V values; none where the coder has no clusters
    std::span<const float> vertex_rmse;    ///< V values, world units
    std::span<const double>
        cluster_deviation;  ///< N values, world units squared a frame (4.7); none likewise
};

/// Writes a result: beside its final name, checked, read back, synced, renamed. Either the whole new file
/// appears or the place stays as it was, whenever the process ends.
class ResultWriter {
 public:
    /// Makes the folder of `path` where it is missing. Errors: kExists (overwrite not given), kIo.
    static Expected<std::unique_ptr<ResultWriter>> create(const std::filesystem::path& path,
                                                          const ResultHeader& header, bool overwrite);
    /// Without a successful finish() before it, removes what was written.
    virtual ~ResultWriter() = default;

    /// /connectivity/bitstream; not called for points.
    virtual Expected<void> write_connectivity(std::span<const std::uint8_t> bitstream) = 0;
    /// /clips/NNNNNN/bitstream, N counted from 0 in the order of the calls.
    virtual Expected<void> write_clip(const ClipSpan& span, std::span<const std::uint8_t> bitstream) = 0;
    /// /analysis/NNNNNN/labels (int32 [V]), …/vertex_rmse (float32 [V]) and …/cluster_deviation (float64 [N])
    /// of the clip written last.
    virtual Expected<void> write_analysis(const ClipAnalysis& analysis) = 0;
    /// Writes /metrics and the digest, closes, reopens and compares every byte of every section, syncs,
    /// renames.
    virtual Expected<void> finish(const ResultMetrics& metrics) = 0;
};

/// A result opened for reading. Every size is checked before anything is allocated, the digest over all
/// sections and attributes when opening.
class ResultReader {
 public:
    /// Errors: kIo, kFormat (no result), kUnsupported (format_version), kCorrupt (digest, layout), kLimit.
    static Expected<std::unique_ptr<ResultReader>> open(const std::filesystem::path& path);
    virtual ~ResultReader() = default;

    virtual const ResultHeader& header() const = 0;
    virtual const ResultMetrics& metrics() const = 0;
    virtual const std::vector<ClipSpan>& clips()
        const = 0;  ///< in order, without gaps, from 0 to frame_count

    /// Empty for points.
    virtual Expected<std::vector<std::uint8_t>> read_connectivity() = 0;
    virtual Expected<std::vector<std::uint8_t>> read_clip(std::int64_t index) = 0;
};

}  // namespace batchenc
