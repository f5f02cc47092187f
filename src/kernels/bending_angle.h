#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/parameters.h"
#include "kernels/mesh_traversal.h"
#include "kernels/steady_math.h"
#include "kernels/surface.h"

namespace batchenc {

/// A place on the lattice that decoded vertices live on: kLatticeParts parts of the quantiser's step.
using LatticePoint = std::array<std::int32_t, 3>;
inline constexpr std::int32_t kLatticeParts = 16;

/// The local coordinate system of a gate (3.2.2): x along it, y in the plane of the reference triangle and
/// away from it.
struct GateFrame {
    std::array<double, 3> origin{};  ///< middle of the gate, lattice units
    std::array<double, 3> x{}, y{}, z{};
    double length = 0.0;  ///< of the gate
};

/// Predicts the bending angle between the triangle at a gate's one side, decoded, and that at the other,
/// whose third corner is to be decoded and lies on a known circle around the gate (3.3, 3.4). All arithmetic
/// is + - * / and square root in a fixed order.
///
/// - kToumaGotsman: mean of the crease angles at the reference triangle's other two edges, where they are
/// decoded (C. Touma and
///   C. Gotsman, "Triangle mesh compression", 1998).
/// - kHope: a polynomial graph of degree 2 over the reference triangle's plane, fitted to decoded vertices
/// nearby, cut with the
///   circle (3.3). The quartic is solved in closed form.
/// - kHopi: an implicit quadric, likewise (3.4.1).
/// - kHops: a sphere through the reference triangle, as curved as those through its neighbours (3.4.2).
/// The last three fall back to the first where nothing can be fitted, or what was fitted does not cut the
/// circle.
class BendingAngle {
 public:
    /// surface: of the mesh, vertices by their places in the traversal; outlives the object. vertex_count: V.
    /// predictor: kToumaGotsman, kHope, kHopi or kHops. fit: every value set (own_fit).
    BendingAngle(const Surface& surface, const NormalFit& fit, GeometryPredictor predictor,
                 std::size_t vertex_count);

    /// The vertex at a place has been decoded.
    void add(std::size_t place, const LatticePoint& point) {
        points_[place] = point;
        is_decoded_[place] = 1;
    }

    /// The angle at a gate with a reference triangle, as a direction in the plane of frame.y and frame.z. x,
    /// radius: where the circle lies; radius > 0.
    UnitVector predict(const Gate& gate, const GateFrame& frame, double x, double radius);

    /// How often predict() was asked, and how often of these it fell back.
    std::int64_t asked() const { return asked_; }
    std::int64_t fell_back() const { return fell_back_; }

 private:
    using Vector = std::array<double, 3>;

    Vector at(std::int32_t v) const;
    const Vector* normal_of(std::int32_t triangle);
    std::int32_t third(std::int32_t half) const { return surface_.start(Surface::previous(half)); }
    bool is_decoded(std::int32_t triangle) const;
    Vector local(std::int32_t v, const GateFrame& frame) const;

    UnitVector predict_creases(const Gate& gate, const GateFrame& frame);
    bool predict_graph(double x, double radius, UnitVector& direction);
    bool predict_implicit(double x, double radius, UnitVector& direction);
    bool predict_sphere(const Gate& gate, const GateFrame& frame, double x, double radius,
                        UnitVector& direction);
    void gather(const Gate& gate, const GateFrame& frame);
    double weight(const Vector& p) const;

    const Surface& surface_;
    NormalFit fit_;
    GeometryPredictor predictor_;
    std::vector<LatticePoint> points_;                       // V
    std::vector<std::uint8_t> is_decoded_;                   // V
    std::vector<Vector> normals_;                            // T: unit normals, where has_normal_
    std::vector<std::uint8_t> has_normal_;                   // T: 0 unknown, 1 there, 2 none
    std::vector<std::int32_t> vertex_seen_, triangle_seen_;  // the number of the gathering that met them last
    std::int32_t gathering_ = 0;
    std::vector<std::int32_t> waiting_;  // half-edges of the gathered region's border
    std::vector<Vector> gathered_;       // in the gate's frame, lattice units
    std::int64_t asked_ = 0, fell_back_ = 0;
};

}  // namespace batchenc
