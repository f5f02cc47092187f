#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/mesh_sequence.h"
#include "kernels/bending_angle.h"
#include "kernels/motion_neighbours.h"

namespace batchenc {

/// Predicts whole lattice points of a sequence, frame by frame, from decoded motion: a vertex moves from
/// where it was by a weighted sum of its neighbours' displacements and a part of what its last prediction
/// missed. Every vertex has weights of its own; after each frame they are fitted to all frames decoded so
/// far, older ones counting less (regularised least squares over decoded data, which a decoder repeats: cf.
/// S. Haykin, "Adaptive Filter Theory", chapter on recursive least squares). What is predicted from is not
/// the lattice point itself but one between it and its prediction, as both err.
///
/// All arithmetic is float32 + - * / in a fixed order, the same bits on every machine and for any width of
/// vectors. Vertices are named by their places in MotionNeighbours::order. Different threads may work on
/// different places of a frame, and on different frames as far as `window` says, if neighbours come first.
class MotionFit {
 public:
    static constexpr std::size_t kBatch = 64;
    static constexpr std::size_t kClasses = 24;   ///< of expected residuals, two an octave
    static constexpr std::size_t kFractions = 4;  ///< of a prediction's distance from a lattice point
    static constexpr std::size_t kContexts = kClasses * kFractions;
    static constexpr std::int64_t kGroup = 8;  ///< places that are fitted at once

    /// The mean residual, in steps, that class c stands for.
    static double magnitude_of_class(std::size_t c);

    /// neighbours: outlives the object. first_frame: V points in steps, whole and what is left of each
    /// coordinate, |rest| <= 1/2. window: frames that are worked on at once.
    MotionFit(const MotionNeighbours& neighbours, std::span<const LatticePoint> first_frame,
              std::span<const float> rest, std::int64_t window);

    /// Predictions of up to kBatch places in a row, four values each, of which the last means nothing.
    struct Batch {
        alignas(32) std::int32_t whole[kBatch][4];    ///< predicted lattice point
        alignas(32) float fraction[kBatch][4];        ///< prediction less that, within 1/2
        alignas(32) float expected[kBatch][4];        ///< magnitudes of the coming residuals, steps
        alignas(32) std::int32_t context[kBatch][4];  ///< of a coordinate, below kContexts
        alignas(32) std::int32_t point[kBatch][4];    ///< decoded lattice point: to be filled before record
    };

    /// Frame 1, 2, …; [first, first + count) in one level, or one place of the coarse part; neighbours of
    /// this frame and all places of the one before are recorded.
    void predict(std::int64_t frame, std::int64_t first, std::int64_t count, Batch& batch) const;
    /// batch: of predict, with its points.
    void record(std::int64_t frame, std::int64_t first, std::int64_t count, const Batch& batch);
    /// Fits the weights of groups [first_group, end_group) once their places and all of their neighbours are
    /// recorded.
    void fit(std::int64_t frame, std::int64_t first_group, std::int64_t end_group);

    // What the kernel works on.
    static constexpr std::size_t kInputs =
        MotionNeighbours::kCount;  ///< differences of displacements, residual
    static constexpr std::size_t kMoments = kInputs * (kInputs + 1) / 2;
    struct alignas(32) Motion {
        float displacement[4];
        float missed[4];  ///< magnitude of the residual
    };
    struct alignas(16) State {
        std::int32_t point[4];
        float offset[4];             ///< from the point to what is predicted from
        float residual[4];           ///< of the last frame
        float used_residual[4];      ///< of the frame before that: what the last frame was predicted with
        float smoothed[4];           ///< running mean of magnitudes
        float target[4];             ///< the last displacement, from what is predicted from to the point
        float weights[kInputs + 4];  ///< of the neighbours, then of the residual
    };
    /// Sums over frames for kGroup places, a lane each.
    struct alignas(64) Moments {
        float products[kMoments][kGroup];
        float with_target[kInputs][kGroup];
    };

 private:
    Motion* motions(std::int64_t frame) const {
        return motions_.get() + static_cast<std::size_t>(frame % window_) * slot_;
    }

    const MotionNeighbours& neighbours_;
    std::int64_t window_;
    std::size_t slot_;                   // motions of a frame: V and one that stands still
    std::unique_ptr<Motion[]> motions_;  // window × slot
    std::vector<State> states_;          // V
    std::vector<Moments> moments_;
};

}  // namespace batchenc
