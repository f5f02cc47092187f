#include "pipeline/result_metrics.h"

#include <algorithm>

namespace batchenc {

SeamJumps find_seam_jumps(std::span<const double> frame_jump, std::span<const ClipSpan> clips) {
    SeamJumps jumps;
    std::int64_t seams = 0, inner = 0;
    for (const ClipSpan& clip : clips) {
        for (std::int64_t i = 0; i < clip.frame_count; ++i) {
            const std::int64_t frame = clip.first_frame + i;
            if (frame == 0) continue;
            const double jump = frame_jump[static_cast<std::size_t>(frame)];
            double& most = i == 0 ? jumps.seam_max : jumps.inner_max;
            most = std::max(most, jump);
            (i == 0 ? jumps.seam_mean : jumps.inner_mean) += jump;
            ++(i == 0 ? seams : inner);
        }
    }
    if (seams > 0) jumps.seam_mean /= static_cast<double>(seams);
    if (inner > 0) jumps.inner_mean /= static_cast<double>(inner);
    return jumps;
}

ResultMetrics make_result_metrics(const ResultBytes& bytes, const ErrorMetrics& errors,
                                  std::span<const ClipSpan> clips, std::int64_t vertex_count,
                                  std::int64_t frame_count, double encode_time_s, double decode_time_s) {
    const auto bits = [](std::int64_t count) { return 8.0 * static_cast<double>(count); };
    const double samples = static_cast<double>(vertex_count) * static_cast<double>(frame_count);
    const std::int64_t total = bytes.connectivity + bytes.clips.total();

    const SeamJumps jumps = find_seam_jumps(errors.frame_jump, clips);
    ResultMetrics metrics;
    metrics.values = {
        {"bits_total", bits(total)},
        {"bits_connectivity", bits(bytes.connectivity - bytes.order)},
        {"bits_order", bits(bytes.order)},
        {"bits_segmentation", bits(bytes.clips.segmentation)},
        {"bits_frames", bits(bytes.clips.frames)},
        {"bits_basis", bits(bytes.clips.basis)},
        {"bits_coefficients", bits(bytes.clips.coefficients)},
        {"bits_residuals", bits(bytes.clips.residuals)},
        {"bits_headers", bits(bytes.clips.headers)},
        {"bpvf", bits(total) / samples},
        {"bpvf_geometry", bits(bytes.clips.total()) / samples},
        {"da", errors.da},
        {"kg", errors.kg},
        {"rmse", errors.rmse},
        {"max_error", errors.max_error},
        {"max_error_relative", errors.max_error_relative},
        {"seam_jump_max", jumps.seam_max},
        {"seam_jump_mean", jumps.seam_mean},
        {"inner_jump_max", jumps.inner_max},
        {"inner_jump_mean", jumps.inner_mean},
        {"encode_time_s", encode_time_s},
        {"decode_time_s", decode_time_s},
    };
    metrics.frame_rmse = errors.frame_rmse;
    metrics.frame_max_error = errors.frame_max_error;
    metrics.frame_jump = errors.frame_jump;
    return metrics;
}

}  // namespace batchenc
