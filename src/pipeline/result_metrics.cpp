#include "pipeline/result_metrics.h"

namespace batchenc {

ResultMetrics make_result_metrics(const ResultBytes& bytes, const ErrorMetrics& errors,
                                  std::int64_t vertex_count, std::int64_t frame_count, double encode_time_s,
                                  double decode_time_s) {
    const auto bits = [](std::int64_t count) { return 8.0 * static_cast<double>(count); };
    const double samples = static_cast<double>(vertex_count) * static_cast<double>(frame_count);
    const std::int64_t total = bytes.connectivity + bytes.clips.total();

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
        {"encode_time_s", encode_time_s},
        {"decode_time_s", decode_time_s},
    };
    metrics.frame_rmse = errors.frame_rmse;
    metrics.frame_max_error = errors.frame_max_error;
    return metrics;
}

}  // namespace batchenc
