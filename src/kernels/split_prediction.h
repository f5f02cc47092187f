#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/parameters.h"
#include "kernels/bending_angle.h"
#include "kernels/gate_prediction.h"
#include "kernels/mesh_traversal.h"
#include "kernels/surface.h"

namespace batchenc {

/// Lattice points a step of SplitPrediction's residuals. Finer than the static coder's: a step is nearly as
/// large as the bound allows, so that little may be lost to rounding.
inline constexpr std::int32_t kSplitParts = 64;

/// Whether a predictor of the splitcoder splits a vertex into tangential components and a bending angle
/// (5.3.2); the others predict a place in space.
inline bool splits(GeometryPredictor predictor) {
    return predictor >= GeometryPredictor::kTime && predictor <= GeometryPredictor::kSpaceTimeMultiway;
}
/// Whether the prediction looks at the surface.
inline bool needs_surface(GeometryPredictor predictor, NormalPredictor normal) {
    return splits(predictor) && normal != NormalPredictor::kTime;
}

/// Where a vertex is thought to be, and how large its residuals may be.
struct SplitTarget {
    enum class Axes : std::uint8_t { kWorld, kLocal, kCircle };

    Axes axes = Axes::kWorld;
    std::array<double, 3> place{};         ///< lattice units; not of a circle
    const GateFrame* frame = nullptr;      ///< whose axes are meant; not kWorld
    std::array<double, 2> tangential{};    ///< of a circle: along the gate, distance from it; lattice units
    UnitVector bend;                       ///< of a circle: the bending angle
    std::array<std::int32_t, 3> nearby{};  ///< mean magnitudes of the neighbours' residuals, sixteenths
    std::array<std::int32_t, 3> past{};    ///< running means of its own in the frames before, sixteenths
    bool has_neighbours = false;
};

/// Predicts the vertices of frames one after another (chapter 5), each from those decoded before it in its
/// frame and from the frame before. Encoder and decoder drive one each through the traversal; all arithmetic
/// is + - * / and square root in a fixed order, on integers that both have, so that every machine predicts
/// the same.
///
/// A gate's local coordinate system (3.2.2, 5.3.2.1) needs a reference triangle that is one: see
/// set_gate_frame. What a vertex' coordinates in it were is kept from the last frame in which there was one.
///
/// - time, space, space-multiway, space-time, space-time-multiway (8.5.1.1): residuals of the place along the
///   first gate, the distance from it, and the length of arc around it, each in steps. The bending angle is
///   predicted as before (time), as the mean of the creases at the reference triangle's other edges
///   (space; C. Touma and C. Gotsman, "Triangle mesh compression", 1998), or as the mean of both.
/// - lorenzo: the place before, moved as the parallelogram of the first gate moved (L. Ibarria and J.
/// Rossignac,
///   "Dynapack", 2003); lorenzo-multiway: the mean over the gates.
/// - replica: the place before in the affine frame of the first gate's reference triangle, whose third axis
///   is as long as the root of the triangle's double area (likewise).
/// - local-multiway: the mean over the gates of the place before in each one's local coordinate system.
///   Residuals of these four are along the axes of the first gate's local coordinate system.
///
/// Without a gate the prediction is the place before, and over an edge without a reference triangle that,
/// moved as the edge's middle moved. Where a gate has no local coordinate system, the place is that of
/// lorenzo-multiway, with residuals along the world's axes.
/// A step is kSplitParts lattice units, of all residuals.
class SplitPrediction {
 public:
    /// traversal: of the mesh; outlives the object. surface: of traversal.in_places(triangles); looked at
    /// only by the constructor, where needs_surface(…), and may be empty otherwise.
    SplitPrediction(const MeshTraversal& traversal, const Surface& surface, GeometryPredictor predictor,
                    NormalPredictor normal);

    /// The first frame: V points by place. Each coordinate within 2^29, here and below.
    void start(std::span<const LatticePoint> points);
    /// All vertices of a frame have been recorded.
    void next_frame();

    /// Prediction of the vertex at a place, which come in order, every frame from 0 on. What it points at
    /// lasts until the next one.
    SplitTarget predict(std::size_t place);
    /// What became of it.
    void record(std::size_t place, const std::array<std::int32_t, 3>& residuals, const LatticePoint& decoded);

    /// Encoding: residuals that lead near a place, lattice units; of those that lead nearer than a bound the
    /// smallest, as far as is found by going from the nearest ones towards zero. squared_bound: in steps; 0
    /// asks for the nearest.
    std::array<std::int32_t, 3> residuals_of(const SplitTarget& target, const std::array<double, 3>& place,
                                             double squared_bound) const;
    /// Where a prediction and residuals lead. Limited to 2^29, which only a corrupt stream reaches.
    LatticePoint reconstruct(const SplitTarget& target, const std::array<std::int32_t, 3>& residuals) const;

    /// Points of the frame recorded last, or being recorded, by place.
    std::span<const LatticePoint> points() const { return points_; }

 private:
    using Vector = std::array<double, 3>;
    struct Crease {
        std::int32_t begin = -1, end = -1, inward = -1, beyond = -1;  // an edge, and the corners beside it
    };

    const Vector& now(std::int32_t place) const { return now_[static_cast<std::size_t>(place)]; }
    GateFrames frames() const { return {now_, before_}; }
    void remember(std::size_t place, const Vector& point);
    void list_creases(const Surface& surface);
    void set_sizes(std::size_t place, std::span<const Gate> gates, SplitTarget& target) const;
    void set_circle(std::size_t place, std::span<const Gate> gates, SplitTarget& target) const;
    void set_axes(SplitTarget& target) const;
    UnitVector bend_by_creases(std::size_t place) const;
    Vector local_multiway(std::size_t place, std::span<const Gate> gates);

    const MeshTraversal& traversal_;
    GeometryPredictor predictor_;
    NormalPredictor normal_;
    bool splits_, keeps_local_;
    double least_height_;                  // of a reference triangle, lattice units
    std::vector<Vector> now_, before_;     // V, by place: integers
    std::vector<LatticePoint> points_;     // V, by place: now_
    std::vector<Vector> local_;            // by gate: coordinates in its system when there last was one
    std::vector<std::uint8_t> has_local_;  // by gate
    std::vector<std::array<std::int32_t, 3>> sizes_, means_;  // V: of this frame's residuals; over frames
    std::vector<std::array<Crease, 3>> creases_;              // V, of the first gate; begin -1: none

    // Of the vertex predicted last.
    std::array<GateFrame, MeshTraversal::kMostGates> frames_;
    std::array<bool, MeshTraversal::kMostGates> has_frame_{};
    std::size_t frame_count_ = 0;
};

}  // namespace batchenc
