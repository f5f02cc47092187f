#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "codecs/clip_bitstream.h"
#include "codecs/rtpca_layout.h"
#include "core/error.h"
#include "core/executor.h"
#include "core/matrix.h"
#include "core/mesh_sequence.h"
#include "kernels/svd.h"

namespace batchenc {

/// A clip coded at one step.
struct RtpcaCoding {
    double step = 0.0;  ///< world units
    std::vector<SectionPayload> sections;
    double squared_error = 0.0;  ///< world units, over all vertices and frames, but for float32's rounding

    std::int64_t size_bytes() const;  ///< of the sections
};

/// What RTPCA finds out about a clip before it quantises: rigid motions, their tree, principal components;
/// kept from one trial coding to the next.
class RtpcaAnalysis {
 public:
    /// What is referred to outlives the object. positions: F × V, finite. labels: V values, every cluster
    /// with a vertex.
    RtpcaAnalysis(PositionsView positions, const MeshTopology& mesh, std::span<const std::int32_t> labels,
                  std::int32_t cluster_count, const Executor& executor);

    /// Largest side of the bounding box.
    double e_max() const { return e_max_; }
    PositionsView positions() const { return positions_; }
    const MeshTopology& mesh() const { return mesh_; }
    const Executor& executor() const { return executor_; }

    /// Codes the clip. step: d, world units; at least 0. Errors: kLimit (the step is too small for the clip,
    /// or its coordinates too large), kNumerical.
    Expected<RtpcaCoding> code(double step);

 private:
    struct Cluster {
        std::vector<std::int32_t> vertices;  // ascending
        RigidBody body;
        TruncatedSvd svd;         // of the trajectories, 3F × r
        double svd_floor = -1.0;  // singular values above this are there; below 0: none yet
        std::int64_t size() const { return static_cast<std::int64_t>(vertices.size()); }
    };

    Expected<CodedBody> quantize_body(const RtpcaHeader& header, const RigidBody& body,
                                      const BodyTrack& relative, const std::array<double, 3>& joint) const;
    Expected<std::vector<CodedBody>> quantize_bodies(const RtpcaHeader& header,
                                                     std::vector<LocalFrameTrack>& tracks) const;
    Expected<void> decompose(double step);

    PositionsView positions_;
    const MeshTopology& mesh_;
    std::span<const std::int32_t> labels_;
    const Executor& executor_;
    double e_max_ = 0.0;
    std::array<float, 3> center_{};
    std::vector<Cluster> clusters_;
    RigidTree tree_;
    TrackTransform transform_;
};

}  // namespace batchenc
