#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include "core/error.h"
#include "core/mesh_sequence.h"

namespace batchenc {

/// What a file of labels holds (docs/RESULTS.md, "Labels").
struct LabelsContent {
    std::string source;  ///< the clip that was segmented
    std::string method;  ///< of segmentation, as in a job
    std::int64_t first_frame = 0;
    std::int64_t frame_count = 0;               ///< frames that were looked at, from first_frame
    double average_deviation = 0.0;             ///< over clusters, world units squared a frame (4.7)
    std::span<const std::int32_t> labels;       ///< V values, 0 … N-1
    std::span<const float> vertex_deviation;    ///< V values, theta in the own cluster, world units squared
    std::span<const Triangle> seed_triangles;   ///< N
    std::span<const double> cluster_deviation;  ///< N values, world units squared a frame
};

/// Writes a file of labels, which appears whole or not at all. Errors: kExists (overwrite not given), kIo.
Expected<void> write_labels(const std::filesystem::path& path, const LabelsContent& content, bool overwrite);

}  // namespace batchenc
