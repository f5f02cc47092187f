#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/error.h"
#include "core/mesh_sequence.h"
#include "kernels/field_order.h"
#include "kernels/rigid_tree.h"

namespace batchenc {

// A layer that brings every vertex of a lossy coder within a bound: where one is too far off, an offset on a
// lattice in the axes of its cluster, which holds until another takes its place.

/// The offset of a vertex from a frame on.
struct Correction {
    std::int32_t frame = 0;
    std::int32_t vertex = 0;
    std::array<std::int32_t, 3> offset{};  ///< in steps, axes of the cluster
};

/// The corrections of a clip, by vertex.
class Corrections {
 public:
    Corrections() = default;
    /// list: ascending frames. bound: world units, above 0. vertex_count: V.
    Corrections(std::span<const Correction> list, double bound, std::int64_t vertex_count);

    bool empty() const { return corrections_.empty(); }
    /// Adds them to frames [begin, begin + out.frame_count()) of the clip; out: decoded frames of V vertices.
    /// labels: V values. tracks: N tracks over the whole clip, whose rotations turn offsets into the world.
    void apply(std::int64_t begin, MutablePositionsView out, std::span<const std::int32_t> labels,
               std::span<const BodyTrack> tracks) const;

 private:
    float step_ = 0.0f;
    std::vector<std::int32_t> first_;      // V + 1 values
    std::vector<Correction> corrections_;  // by vertex, ascending frames
    std::vector<std::int32_t> vertices_;   // that have any
};

/// Finds the corrections of a clip and codes them. source, decoded: F × V. order: of all vertices. labels,
/// tracks: as of apply. Error kLimit: float32 cannot hold a place within the bound.
Expected<std::vector<std::uint8_t>> encode_corrections(PositionsView source, PositionsView decoded,
                                                       const FieldOrder& order,
                                                       std::span<const std::int32_t> labels,
                                                       std::span<const BodyTrack> tracks, double bound);

/// The bound of a coded layer, world units. Error: kCorrupt.
Expected<double> read_bound(std::span<const std::uint8_t> payload);
/// The way back. size_limit_bytes: of what is allocated. Errors: kCorrupt, kLimit.
Expected<Corrections> decode_corrections(std::span<const std::uint8_t> payload, const FieldOrder& order,
                                         std::int64_t frame_count, std::int64_t size_limit_bytes);

}  // namespace batchenc
