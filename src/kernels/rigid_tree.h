#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/mesh_sequence.h"
#include "kernels/local_frame.h"

namespace batchenc {

/// A rigid motion p = R r + t of places at rest.
struct BodyMotion {
    std::array<double, 9> rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1};  ///< row by row
    std::array<double, 3> translation = {0, 0, 0};

    std::array<double, 3> apply(const std::array<double, 3>& rest) const;
    /// The motion that is this one after `first`.
    BodyMotion after(const BodyMotion& first) const;
    /// This motion as seen in the frame that moves with `parent`: parent.after(result) is this.
    BodyMotion relative_to(const BodyMotion& parent) const;
    /// This motion, and a way after it.
    BodyMotion moved_by(const std::array<float, 3>& way) const;
    /// p = Tᵀ q + o with the LCF of a frame, and local coordinates q for places at rest.
    static BodyMotion of(const LocalFrameTrack& track, std::int64_t frame);
    /// The way back: q = T (p - o).
    LocalFrame local_frame() const;
};
using BodyTrack = std::vector<BodyMotion>;  ///< one motion a frame

/// The rotation about a vector's direction by its length in radians, by + - * / and square roots in a fixed
/// order: the same bits on every machine (O. Rodrigues, 1840).
std::array<double, 9> rotation_of(const std::array<double, 3>& vector);
/// The vector of a rotation; of those that differ by whole turns the one nearest to `near`.
std::array<double, 3> rotation_vector(const std::array<double, 9>& rotation,
                                      const std::array<double, 3>& near);

/// A cluster as the tree sees it.
struct RigidBody {
    BodyTrack track;                    ///< F motions
    std::array<double, 3> center = {};  ///< of its vertices at rest, world units
    double radius = 0.0;                ///< root of their mean squared distance from it, world units
    std::int64_t vertex_count = 0;
};

/// Which cluster each one's motion is described against, so that what remains moves least: a minimum spanning
/// tree over the clusters and the world (R. C. Prim, 1957), where an edge costs the squared steps from frame
/// to frame that the one's vertices make in the other's frame.
struct RigidTree {
    std::vector<std::int32_t> parent;  ///< N values; -1 for the world
    std::vector<std::int32_t> order;   ///< N clusters, parents before children

    /// Beyond kMostBodies all are described against the world. Frames: up to 64 steps are looked at.
    static constexpr std::size_t kMostBodies = 1024;
    static RigidTree of(std::span<const RigidBody> bodies);
    /// The order from the parents; empty when they make no tree.
    static std::vector<std::int32_t> order_of(std::span<const std::int32_t> parent);
};

/// The place at rest of a body that moves least under a track, regularised towards its centre: the joint, in
/// the frame of the parent. track: F motions.
std::array<double, 3> joint_of(const BodyTrack& track, const std::array<double, 3>& center, double radius);

}  // namespace batchenc
