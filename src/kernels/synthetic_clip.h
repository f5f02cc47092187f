#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "core/error.h"
#include "core/mesh_sequence.h"

namespace batchenc {

/// A sample animation, made a frame at a time so that its length needs no memory.
class SyntheticClip {
 public:
    virtual ~SyntheticClip() = default;
    virtual std::int64_t vertex_count() const = 0;
    virtual const std::vector<Triangle>& triangles() const = 0;
    virtual double fps() const = 0;
    /// Writes frame `frame` (any non-negative number, in any order) to positions, 3 × V float32, world units.
    virtual void write_frame(std::int64_t frame, std::span<float> positions) const = 0;
};

/// Makes a clip that is the same, bit for bit on one machine, for the same arguments. Kinds:
///   walker  an articulated figure that walks: near-rigid parts with skinned joints, six closed components
///   flag    a cloth pinned at one side that waves in the wind; one component with a boundary
///   jelly   a closed elastic body that falls, bounces and wobbles
///   medley  all three in one scene, a third of the vertices each; they perform in turn, in acts of about
///   twenty
///           seconds with a gait, wind or excitation of its own, while the others hardly move
/// Lengths are metres, z points up, and no motion repeats.
///
/// vertex_count: wanted vertices, 64 (medley: 256) … 1,000,000; the clip has the nearest count its
/// construction allows (within 5 %). Errors: kInvalidArgument for an unknown kind (the message lists the
/// kinds) or a count outside the range; kOutOfMemory.
Expected<std::unique_ptr<SyntheticClip>> make_synthetic_clip(std::string_view kind, std::int64_t vertex_count,
                                                             std::uint64_t seed);

}  // namespace batchenc
