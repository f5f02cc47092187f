#pragma once

#include <cstdint>
#include <vector>

#include "core/executor.h"
#include "core/matrix.h"
#include "core/mesh_sequence.h"

namespace batchenc {

/// What is known of a coder of clusters when a sequence is to be cut into clips.
struct ClipCutModel {
    std::int64_t longest = 1024;  ///< frames of a clip at most, at least 32
    std::int64_t shortest = 32;   ///< frames of a clip at least, but of the last; at most 32
    std::int32_t groups = 16;     ///< of vertices that stand for the clusters, at least 1
    bool local = true;            ///< the coder takes each cluster's rigid motion away
    double accuracy = 2e-4;       ///< error that is aimed at, as part of the largest side of the first frame
    double vertex_bits = 4.0;     ///< what a clip costs besides its components, bits a vertex
};

/// Cuts a sequence into clips where its motion changes: the bits of coding frames [a, b) as one clip are
/// modelled for all a and b of a grid of 16 frames, and dynamic programming finds the cuts with the least
/// sum.
///
/// The model: a dozen vertices of each group, their rigid motion taken away, are a matrix of 3n rows and a
/// column a frame. Principal components with the eigenvalues s of its second moments take
/// sum of 1/2 log2(1 + s / accuracy^2) bits (reverse water-filling) for each of their values, of which there
/// are three for every vertex of the group and one for every frame: what a new clip pays again is the first
/// part, what it saves is components that its motion does not need.
///
/// Vertices are sampled from the first frame alone. The cuts depend neither on how the frames come in runs
/// nor on the executor. Memory: about 11 MiB with 16 groups and 1024 frames, and 12 bytes a grid point.
class ClipCutter {
 public:
    /// vertex_count: V of every frame, at least 1.
    ClipCutter(std::int64_t vertex_count, const ClipCutModel& model);

    /// Adds the next frames, F × V, finite.
    void add(PositionsView frames, const Executor& executor);

    /// Frames of each clip, in order; none without frames. Called once, after the last frame.
    std::vector<std::int64_t> finish(const Executor& executor);

 private:
    /// Some vertices that stand for a cluster.
    struct Group {
        std::vector<std::int32_t> members;  // among the samples
        double vertex_count = 0.0;          // of the sequence, that it stands for
        std::vector<ColMajorMatrixXd>
            moments;  // second moments of a run each, 3n × 3n; the newest runs, in a ring
    };
    /// A place where a clip may begin or end.
    struct Place {
        double bits;               // of everything before it
        std::int32_t clip_frames;  // of the clip before it
    };

    void choose_samples(PositionsView first_frame);
    void end_run(const Executor& executor);
    void measure_run(Group& group, PositionsView run) const;
    std::vector<double> bits_of_clips(const Group& group, bool is_last) const;
    void choose_cut(const Executor& executor, bool is_last);

    std::int64_t vertex_count_;
    ClipCutModel model_;
    double error_ = 0.0;  // world units
    std::vector<std::int32_t> samples_;
    std::vector<float> rest_;  // of the samples: the first frame
    std::vector<float> run_;   // of the samples: frames since the last place
    std::vector<Group> groups_;
    std::size_t ring_ = 1;  // runs that are remembered
    std::int64_t frame_count_ = 0;
    std::vector<Place> places_;  // at every 16 frames, and the end
};

}  // namespace batchenc
