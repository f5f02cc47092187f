#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/parameters.h"
#include "kernels/bending_angle.h"
#include "kernels/mesh_traversal.h"

namespace batchenc {

/// A predictor and how much it expects the surface to go on curving: parts of sixteen, 0 … 16, of the normal
/// residuals nearby; of the local predictors only.
struct PredictionForm {
    GeometryPredictor predictor = GeometryPredictor::kMultiway;
    std::uint8_t curvature = 0;
    TangentialPredictor tangential = TangentialPredictor::kFitted;  ///< of those with a bending angle
    NormalFit fit;                                                  ///< likewise, every value set (own_fit)
};

/// Whether a predictor splits vertices into tangential components and a bending angle (3.2).
inline bool bends(GeometryPredictor predictor) {
    return predictor >= GeometryPredictor::kToumaGotsman && predictor <= GeometryPredictor::kHops;
}

/// Whether a form looks at the surface.
bool needs_surface(const PredictionForm& form);

/// Where a vertex is thought to be and how far it may be from there.
struct VertexPrediction {
    std::array<double, 3> place{};  ///< lattice units
    bool in_world_axes = true;      ///< residuals are along x, y, z
    std::array<double, 9>
        axes;  ///< rows: their directions, where they are others; of local predictors always
    std::array<std::int32_t, 3> sizes{};  ///< expected magnitudes of the residuals, sixteenths of a step
    int gates = 0;                        ///< reference triangles behind it: 0, 1, 2 (or more)

    // Of predictors with a bending angle, where there is a gate to bend at: `place` is its middle, `axes` its
    // local coordinate system; residuals are of the place along the gate, the distance from it, and the
    // length of arc around it.
    const Gate* gate = nullptr;
    double gate_length = 0.0;
    std::array<double, 2> tangential{};  ///< along the gate, distance from it; lattice units
    std::optional<UnitVector> bend;      ///< once it was asked for: the angle predicted
};

/// Predicts the vertices of one frame from those decoded before, and keeps what the prediction needs. Encoder
/// and decoder drive one each through the same traversal; all arithmetic is + - * / and square root in a
/// fixed order, and what is kept is integers or follows from integers, so that every machine predicts the
/// same.
///
/// - parallelogram: left + right - opposite of the first gate, world axes (C. Touma and C. Gotsman, "Triangle
///   mesh compression", 1998). multiway: the mean over all gates (3.2.3).
/// - local: the same places; residuals along the gate, across it, and along the mean normal of the reference
///   triangles' planes, the normal part predicted from that of the gate's ends (curvature).
/// - fitted: local multiway, corrected by weights for the shape of the neighbourhood that are fitted to the
///   vertices decoded before, by recursive least squares.
/// - weighted: local multiway, from parallelograms skewed by what the valences at the gate's ends say of the
/// angles there
///   (cf. L. Vasa and G. Brunnett, "Exploiting connectivity to improve the tangential part of geometry
///   prediction", 2013).
/// - touma-gotsman, hope, hopi, hops: tangential components by parallelogram or multi-way prediction, the
/// bending angle
///   by kernels/bending_angle.
/// Vertices without a reference triangle: middle of the edge, decoded neighbour, or vertex before.
class StaticPrediction {
 public:
    /// traversal: of the mesh; outlives the object. surface: of traversal.in_places(triangles), likewise;
    /// looked at only where needs_surface(form), and may be empty otherwise.
    StaticPrediction(const MeshTraversal& traversal, const Surface& surface, const PredictionForm& form);

    /// Prediction of the vertex traversal.order[place]; places come in order.
    VertexPrediction predict(std::size_t place);
    /// What became of it: residuals in steps along its axes, and where it was decoded.
    void record(std::size_t place, const std::array<std::int32_t, 3>& residuals, const LatticePoint& decoded);

    /// Encoding: the residuals that lead nearest to a place, in lattice units, of the vertex predicted last.
    std::array<std::int32_t, 3> residuals_of(VertexPrediction& prediction,
                                             const std::array<double, 3>& place);
    /// Where a prediction and residuals lead: rounded to the lattice. Clamped to 2^29, which only a corrupt
    /// stream reaches. Of the vertex predicted last.
    LatticePoint reconstruct(VertexPrediction& prediction, const std::array<std::int32_t, 3>& residuals);

    /// None for predictors without a bending angle.
    const std::optional<BendingAngle>& bending() const { return bending_; }

    /// V, by vertex.
    std::vector<LatticePoint> points() const;

 private:
    using Vector = std::array<double, 3>;
    /// Of one class of neighbourhoods, sums over the vertices decoded: of products of two directions with
    /// each other and with what the plain prediction missed.
    struct Fit {
        double uu = 0, uv = 0, vv = 0, ut = 0, vt = 0;
    };

    /// What is kept of the vertex at a place: half a line of cache.
    struct Decoded {
        LatticePoint point{};
        std::array<std::int32_t, 3> sizes{};  ///< magnitudes of residuals, sixteenths
        float bend = 0.0f;                    ///< normal residual with its prediction, steps
        float cotangent = 0.0f;  ///< of the mean angle of a triangle there; weighted predictors only
    };

    Vector at(std::int32_t place) const;
    /// Where one reference triangle leads.
    Vector beyond(const Gate& gate) const;
    void correct(std::span<const Gate> gates, Vector& place);
    void set_axes(std::span<const Gate> gates, VertexPrediction& prediction) const;
    void set_sizes(std::span<const Gate> gates, VertexPrediction& prediction) const;
    /// The local coordinate system of the gate, and the tangential prediction in it; leaves a prediction
    /// whose gate is degenerate.
    void set_circle(const Gate& gate, VertexPrediction& prediction) const;
    /// The predicted angle on the circle of decoded tangential components.
    const UnitVector& bend_of(VertexPrediction& prediction, double x, double radius);

    const MeshTraversal& traversal_;
    PredictionForm form_;
    std::vector<Decoded> decoded_;  // V, by place
    std::array<Fit, 4> fits_;
    std::array<std::int32_t, 3> lone_sizes_;  // of vertices without gates, a running mean
    std::optional<BendingAngle> bending_;

    // Of the vertex predicted last.
    Fit* fit_ = nullptr;
    Vector plain_{}, u_{}, v_{};
    double bend_ = 0.0;
    int gates_ = 0;
};

}  // namespace batchenc
