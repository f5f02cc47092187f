#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/executor.h"
#include "core/mesh_sequence.h"

namespace batchenc {

/// Distortion of a decoded sequence against its source; definitions in docs/GLOSSARY.md.
struct ErrorMetrics {
    double da =
        0.0;  ///< percent, over each vertex' mean over time (Amjoun, section 8.3); NaN where undefined
    double kg =
        0.0;  ///< percent, over each frame's mean position (Karni and Gotsman 2004); NaN where undefined
    double da_spread = 0.0;  ///< what da is over: squared distances from each vertex' mean over time, summed
    double kg_spread = 0.0;  ///< what kg is over: squared distances from each frame's mean position, summed
    double rmse = 0.0;       ///< sqrt of the mean squared vertex distance, world units
    double max_error = 0.0;  ///< largest vertex distance, world units
    double max_error_relative = 0.0;  ///< max_error over the diagonal of the source's bounding box; NaN where
                                      ///< that is 0 and max_error is not
    double diagonal = 0.0;  ///< diagonal of the bounding box of all frames of the source, world units
    std::vector<double> frame_rmse;       ///< F values, world units
    std::vector<double> frame_max_error;  ///< F values, world units
    std::vector<double> frame_jump;       ///< F values, world units: how far the error of a vertex moves from
                                          ///< the frame before, root of the mean square; 0 for the first
};

/// Collects ErrorMetrics over consecutive runs of frames (clips) of one sequence, in bounded memory: 60 bytes
/// a vertex, 24 a frame, and while a run is added 80 a frame and block of 2048 vertices. Sums are double
/// precision about an origin taken from the data, in an order that neither the executor nor the CPU changes.
class ErrorMeter {
 public:
    /// vertex_count: V of every frame, at least 0.
    explicit ErrorMeter(std::int64_t vertex_count);

    /// Adds the next frames. source and decoded have the same shape, V as constructed; both finite.
    void add(PositionsView source, PositionsView decoded, const Executor& executor);

    /// Metrics of all frames added so far. A quotient 0/0 is 0 (nothing moved and nothing is wrong); x/0 is
    /// NaN.
    ErrorMetrics finish() const;

    /// What one block of vertices adds to one frame.
    struct Partial {
        double squared_error;              ///< sum over its vertices
        double squared_jump;               ///< of the change of the error since the frame before, likewise
        double max_squared_error;          ///< of a vertex
        std::array<double, 3> sum;         ///< of its positions about the frame's origin
        double sum_of_squares;             ///< of the same
        double sum_of_squares_about_past;  ///< of its positions about those of the first frame
    };
    /// Bounding box of one block of vertices, all its frames; per lane of three interleaved coordinates.
    struct Bounds {
        std::array<float, 3> low, high;
    };

 private:
    void keep_last(PositionsView source, PositionsView decoded);

    struct Frame {
        double squared_error, squared_jump, max_squared_error;
    };
    std::int64_t vertex_count_;
    std::int64_t block_count_;
    std::vector<float>
        origin_;  // 3 V: the first frame, subtracted before summing so that offsets cost no digits
    std::vector<float> last_source_, last_decoded_;  // 3 V: of the frame added last
    std::vector<double> sum_;      // 3 V rounded up to whole groups: over frames, about origin_
    double sum_of_squares_ = 0.0;  // over vertices and frames, about origin_
    double squared_spread_ = 0.0;  // over frames, about each frame's mean
    std::vector<Bounds> bounds_;   // a block each
    std::vector<Frame> frames_;
    std::vector<Partial> partials_;  // of the run being added: [frame][block]
};

}  // namespace batchenc
