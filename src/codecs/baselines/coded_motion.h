#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/error.h"
#include "core/mesh_sequence.h"
#include "kernels/local_frame.h"

namespace batchenc {

/// The motion of a whole clip as one body, a rotation and a place in every frame, as baseline-pca codes it:
/// seven series along time of quaternions on a lattice of 2^-16 and of places on one of e_max / 2^16.
class CodedMotion {
 public:
    /// center, largest_side: of the clip's bounding box, world units.
    CodedMotion(std::array<float, 3> center, float largest_side)
        : center_(center), largest_side_(largest_side) {}

    /// Rounds the motion that brings every frame best to the first one (kernels/rigid_motion.h).
    void set_best(PositionsView positions);

    std::vector<std::uint8_t> write() const;
    /// Error: kCorrupt.
    Expected<void> read(std::span<const std::uint8_t> payload, std::int64_t frame_count);

    /// What it stands for, the same on every machine: where a quaternion is zero no rotation.
    LocalFrameTrack track() const;

 private:
    double step() const;

    std::array<float, 3> center_;
    float largest_side_;
    std::array<std::vector<std::int32_t>, 7> series_;  // w, x, y, z; then the place about the centre
};

}  // namespace batchenc
