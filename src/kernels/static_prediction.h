#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/parameters.h"
#include "kernels/mesh_traversal.h"

namespace batchenc {

/// A predictor and how much it expects the surface to go on curving: parts of sixteen, 0 … 16, of the normal
/// residuals nearby; of the local predictors only.
struct PredictionForm {
    GeometryPredictor predictor = GeometryPredictor::kMultiway;
    std::uint8_t curvature = 0;
};

/// A place on the lattice that decoded vertices live on: kLatticeParts parts of the quantiser's step.
using LatticePoint = std::array<std::int32_t, 3>;
inline constexpr std::int32_t kLatticeParts = 16;

/// Where a vertex is thought to be and how far it may be from there.
struct VertexPrediction {
    std::array<double, 3> place{};                             ///< lattice units
    std::array<double, 9> axes = {1, 0, 0, 0, 1, 0, 0, 0, 1};  ///< rows: the directions of the residuals
    bool in_world_axes = true;                                 ///< axes is the identity
    std::array<std::int32_t, 3> sizes{};  ///< expected magnitudes of the residuals, sixteenths of a step
    int gates = 0;                        ///< reference triangles behind it: 0, 1, 2 (or more)
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
/// Vertices without a reference triangle: middle of the edge, decoded neighbour, or vertex before.
class StaticPrediction {
 public:
    /// traversal: of the mesh; outlives the object.
    StaticPrediction(const MeshTraversal& traversal, const PredictionForm& form);

    /// Prediction of the vertex traversal.order[place]; places come in order.
    VertexPrediction predict(std::size_t place);
    /// What became of it: residuals in steps along its axes, and where it was decoded.
    void record(std::size_t place, const std::array<std::int32_t, 3>& residuals, const LatticePoint& decoded);

    /// Where a prediction and residuals lead: rounded to the lattice. Clamped to 2^29, which only a corrupt
    /// stream reaches.
    static LatticePoint reconstruct(const VertexPrediction& prediction,
                                    const std::array<std::int32_t, 3>& residuals);

    const std::vector<LatticePoint>& points() const { return points_; }  ///< V

 private:
    using Vector = std::array<double, 3>;
    /// Of one class of neighbourhoods, sums over the vertices decoded: of products of two directions with
    /// each other and with what the plain prediction missed.
    struct Fit {
        double uu = 0, uv = 0, vv = 0, ut = 0, vt = 0;
    };

    Vector at(std::int32_t v) const;
    void correct(std::span<const Gate> gates, Vector& place);
    void set_axes(std::span<const Gate> gates, VertexPrediction& prediction) const;
    void set_sizes(std::span<const Gate> gates, VertexPrediction& prediction) const;

    const MeshTraversal& traversal_;
    PredictionForm form_;
    std::vector<LatticePoint> points_;                // V
    std::vector<std::array<std::int32_t, 3>> sizes_;  // V: magnitudes of residuals, sixteenths
    std::vector<float> bends_;                        // V: normal residual with its prediction, steps
    std::array<Fit, 4> fits_;
    std::array<std::int32_t, 3> lone_sizes_;  // of vertices without gates, a running mean

    // Of the vertex predicted last.
    Fit* fit_ = nullptr;
    Vector plain_{}, u_{}, v_{};
    double bend_ = 0.0;
    int gates_ = 0;
};

}  // namespace batchenc
