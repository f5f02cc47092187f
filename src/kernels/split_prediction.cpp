#include "kernels/split_prediction.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "kernels/gate_prediction.h"

namespace batchenc {
namespace {

using Vector = std::array<double, 3>;

constexpr std::int32_t kLargestSize = 1 << 23;
constexpr std::int32_t kSizeUnit = 16;
constexpr double kStep = kSplitParts;
constexpr double kLeastRadius = kStep / 2;  // that arcs are measured on, lattice units
// Least heights of reference triangles, lattice units. On a circle a vertex hangs on one of them alone; of a
// mean one that is nearly degenerate is still worth more than none (measured on cow, dance and samba).
constexpr double kLeastHeightOfOne = kStep / 2, kLeastHeightOfMany = 1.0;

/// Of steps: predictions far outside give residuals that stop at 2^28, so that the vertex is coded exactly.
std::int32_t rounded(double steps) {
    constexpr double kLimit = 1 << 28;
    return nearest_integer(steps > -kLimit ? (steps < kLimit ? steps : kLimit) : -kLimit);
}

/// Goes from the nearest residuals towards zero as long as the squared distance, in steps, stays within the
/// bound, and first where that loses least. rest: place minus residuals.
void shrink(std::array<std::int32_t, 3>& residuals, Vector& rest, double squared_bound) {
    double distance = dot(rest, rest);
    for (;;) {
        std::size_t best = 3;
        double least = squared_bound - distance;
        for (std::size_t c = 0; c < 3; ++c) {
            if (residuals[c] == 0) continue;
            const double loss = 2.0 * (residuals[c] > 0 ? rest[c] : -rest[c]) + 1.0;
            if (loss <= least) {
                least = loss;
                best = c;
            }
        }
        if (best == 3) return;
        const int sign = residuals[best] > 0 ? 1 : -1;
        residuals[best] -= sign;
        rest[best] += sign;
        distance += least;
    }
}

bool set_direction(double x, double y, UnitVector& direction) {
    const double length = std::sqrt(x * x + y * y);
    if (!(length > 0.0)) return false;
    direction = {x / length, y / length};
    return true;
}

}  // namespace

SplitPrediction::SplitPrediction(const MeshTraversal& traversal, const Surface& surface,
                                 GeometryPredictor predictor, NormalPredictor normal)
    : traversal_(traversal),
      predictor_(predictor),
      normal_(normal),
      splits_(splits(predictor)),
      keeps_local_(splits_ || predictor == GeometryPredictor::kLocalMultiway),
      least_height_(splits_ ? kLeastHeightOfOne : kLeastHeightOfMany),
      now_(traversal.order.size()),
      before_(traversal.order.size()),
      points_(traversal.order.size()),
      sizes_(traversal.order.size()),
      means_(traversal.order.size()) {
    if (keeps_local_) {
        local_.resize(traversal.gates.size());
        has_local_.resize(traversal.gates.size());
    }
    if (needs_surface(predictor, normal)) list_creases(surface);
}

/// The edges of each first gate's reference triangle beyond which there is a triangle
/// whose corners all come before the vertex.
void SplitPrediction::list_creases(const Surface& surface) {
    creases_.resize(traversal_.order.size());
    for (std::size_t k = 0; k < creases_.size(); ++k) {
        const auto gates = traversal_.gates_of(k);
        if (gates.empty() || gates[0].opposite < 0) continue;
        std::size_t count = 0;
        for (std::int32_t h = 3 * gates[0].triangle; h < 3 * gates[0].triangle + 3; ++h) {
            const std::int32_t other = surface.twin[static_cast<std::size_t>(h)];
            if (other < 0) continue;
            const Triangle& beyond = surface.triangles[static_cast<std::size_t>(other / 3)];
            const auto place = static_cast<std::int32_t>(k);
            if (beyond[0] >= place || beyond[1] >= place || beyond[2] >= place) continue;
            creases_[k][count++] = {surface.start(h), surface.start(Surface::next(h)),
                                    surface.start(Surface::previous(h)),
                                    surface.start(Surface::previous(other))};
        }
    }
}

void SplitPrediction::start(std::span<const LatticePoint> points) {
    for (std::size_t k = 0; k < points.size(); ++k) {
        points_[k] = points[k];
        for (std::size_t c = 0; c < 3; ++c) now_[k][c] = points[k][c];
        if (!keeps_local_) continue;
        const auto gates = traversal_.gates_of(k);
        frame_count_ = splits_ ? std::min<std::size_t>(gates.size(), 1) : gates.size();
        for (std::size_t g = 0; g < frame_count_; ++g)
            has_frame_[g] =
                gates[g].opposite >= 0 && set_gate_frame(gates[g], now_, least_height_, frames_[g]);
        remember(k, now_[k]);
    }
    next_frame();
}

void SplitPrediction::next_frame() { now_.swap(before_); }

inline void SplitPrediction::remember(std::size_t place, const Vector& point) {
    const auto first = static_cast<std::size_t>(traversal_.first_gate[place]);
    for (std::size_t g = 0; g < frame_count_; ++g) {
        if (!has_frame_[g]) continue;
        local_[first + g] = into_frame(frames_[g], point);
        has_local_[first + g] = 1;
    }
}

inline void SplitPrediction::set_sizes(std::size_t place, std::span<const Gate> gates,
                                       SplitTarget& target) const {
    target.past = means_[place];
    if (gates.empty()) return;
    // The first two gates' ends, and with one gate the corner behind it.
    std::array<std::int32_t, 3> sum{};  // at most five of kLargestSize
    std::int32_t count = 0;
    const auto add = [&](std::int32_t p) {
        const auto& sizes = sizes_[static_cast<std::size_t>(p)];
        for (std::size_t c = 0; c < 3; ++c) sum[c] += sizes[c];
        ++count;
    };
    for (const Gate& gate : gates.first(std::min<std::size_t>(gates.size(), 2))) {
        add(gate.left);
        add(gate.right);
    }
    if (gates.size() == 1 && gates[0].opposite >= 0) add(gates[0].opposite);
    for (std::size_t c = 0; c < 3; ++c) target.nearby[c] = sum[c] / count;
    target.has_neighbours = true;
}

SplitTarget SplitPrediction::predict(std::size_t place) {
    SplitTarget target;
    const std::span<const Gate> gates = traversal_.gates_of(place);
    frame_count_ = 0;
    set_sizes(place, gates, target);
    if (gates.empty()) {
        target.place = before_[place];
    } else if (gates[0].opposite < 0) {
        target.place = moved_with_edge(gates[0], place, frames());
    } else if (predictor_ == GeometryPredictor::kLocalMultiway) {
        target.place = local_multiway(place, gates);
        set_axes(target);
    } else {
        has_frame_[0] = set_gate_frame(gates[0], now_, least_height_, frames_[0]);
        frame_count_ = 1;
        if (splits_ && has_frame_[0]) {
            set_circle(place, gates, target);
            return target;
        }
        if (predictor_ != GeometryPredictor::kReplica || !replica(gates[0], place, frames(), target.place)) {
            const auto used = predictor_ == GeometryPredictor::kLorenzo ? gates.first(1) : gates;
            target.place = lorenzo(used, place, frames());
        }
        set_axes(target);
    }
    return target;
}

inline void SplitPrediction::set_axes(SplitTarget& target) const {
    if (!has_frame_[0]) return;
    target.axes = SplitTarget::Axes::kLocal;
    target.frame = &frames_[0];
}

inline Vector SplitPrediction::local_multiway(std::size_t place, std::span<const Gate> gates) {
    const auto first = static_cast<std::size_t>(traversal_.first_gate[place]);
    frame_count_ = gates.size();
    Vector sum{};
    int count = 0;
    for (std::size_t g = 0; g < gates.size(); ++g) {
        GateFrame& frame = frames_[g];
        has_frame_[g] = set_gate_frame(gates[g], now_, least_height_, frame);
        if (!has_frame_[g] || !has_local_[first + g]) continue;
        sum = plus(sum, out_of_frame(frame, local_[first + g]));
        ++count;
    }
    return count == 0 ? lorenzo(gates, place, frames()) : times(1.0 / count, sum);
}

inline UnitVector SplitPrediction::bend_by_creases(std::size_t place) const {
    const Vector& z = frames_[0].z;
    double cosine = 0.0, sine = 0.0;
    for (const Crease& crease : creases_[place]) {
        if (crease.begin < 0) break;
        const Vector& a = now(crease.begin);
        const Vector edge = minus(now(crease.end), a);
        const double square = dot(edge, edge);
        if (!(square > 0.0)) continue;
        const Vector inward = minus(now(crease.inward), a);
        const Vector away = minus(times(dot(inward, edge) / square, edge), inward);
        const double length = std::sqrt(dot(away, away));
        if (!(length > 0.0)) continue;
        const Vector beyond = minus(now(crease.beyond), a);
        UnitVector bend;
        if (!set_direction(dot(beyond, away) / length, dot(beyond, z), bend)) continue;
        cosine += bend.cosine;
        sine += bend.sine;
    }
    UnitVector mean;
    set_direction(cosine, sine, mean);
    return mean;
}

inline void SplitPrediction::set_circle(std::size_t place, std::span<const Gate> gates,
                                        SplitTarget& target) const {
    using enum GeometryPredictor;
    const GateFrame& frame = frames_[0];
    target.axes = SplitTarget::Axes::kCircle;
    target.frame = &frame;
    const auto first = static_cast<std::size_t>(traversal_.first_gate[place]);
    const Vector& local = local_[first];
    const bool has_past = has_local_[first] != 0;
    const double past_radius = std::sqrt(local[1] * local[1] + local[2] * local[2]);
    if (predictor_ == kTime && has_past) {
        target.tangential = {local[0], past_radius};
    } else {
        const bool is_multiway = predictor_ == kSpaceMultiway || predictor_ == kSpaceTimeMultiway;
        Vector sum{};
        const auto used = is_multiway ? gates : gates.first(1);
        for (const Gate& gate : used) sum = plus(sum, parallelogram(gate, now_));
        const Vector offset = minus(times(1.0 / static_cast<double>(used.size()), sum), frame.origin);
        const double y = dot(offset, frame.y), z = dot(offset, frame.z);
        target.tangential = {dot(offset, frame.x), std::sqrt(y * y + z * z)};
        if (has_past && (predictor_ == kSpaceTime || predictor_ == kSpaceTimeMultiway))
            target.tangential = {0.5 * (target.tangential[0] + local[0]),
                                 0.5 * (target.tangential[1] + past_radius)};
    }
    UnitVector past;
    const bool knows_past = has_past && set_direction(local[1], local[2], past);
    if (normal_ != NormalPredictor::kTime) {
        target.bend = bend_by_creases(place);
        // The mean of two angles; of opposite ones the first stays.
        if (normal_ == NormalPredictor::kSpaceTime && knows_past)
            set_direction(target.bend.cosine + past.cosine, target.bend.sine + past.sine, target.bend);
    } else if (knows_past) {
        target.bend = past;
    }
}

std::array<std::int32_t, 3> SplitPrediction::residuals_of(const SplitTarget& target,
                                                          const std::array<double, 3>& place,
                                                          double squared_bound) const {
    constexpr double kPerUnit = 1.0 / kStep;
    std::array<std::int32_t, 3> residuals;
    Vector steps, rest;
    if (target.axes != SplitTarget::Axes::kCircle) {
        steps = times(kPerUnit, minus(place, target.place));
        if (target.axes == SplitTarget::Axes::kLocal) {
            const GateFrame& frame = *target.frame;
            steps = {dot(steps, frame.x), dot(steps, frame.y), dot(steps, frame.z)};
        }
        for (std::size_t c = 0; c < 3; ++c) {
            residuals[c] = rounded(steps[c]);
            rest[c] = steps[c] - residuals[c];
        }
        shrink(residuals, rest, squared_bound);
        return residuals;
    }
    const GateFrame& frame = *target.frame;
    const Vector offset = minus(place, frame.origin);
    const double x = dot(offset, frame.x), y = dot(offset, frame.y), z = dot(offset, frame.z);
    const UnitVector& bend = target.bend;
    const double turn = angle_of(bend.cosine * y + bend.sine * z, bend.cosine * z - bend.sine * y);
    const auto arc = [&](std::int32_t residual) {
        return turn * std::max(kLeastRadius, target.tangential[1] + residual * kStep) * kPerUnit;
    };
    steps = {(x - target.tangential[0]) * kPerUnit,
             (std::sqrt(y * y + z * z) - target.tangential[1]) * kPerUnit, 0.0};
    residuals = {rounded(steps[0]), rounded(steps[1]), 0};
    const std::int32_t nearest_radius = residuals[1];
    steps[2] = arc(nearest_radius);
    residuals[2] = rounded(steps[2]);
    for (std::size_t c = 0; c < 3; ++c) rest[c] = steps[c] - residuals[c];
    shrink(residuals, rest, squared_bound);
    if (residuals[1] != nearest_radius) {  // another radius, another arc
        steps[2] = arc(residuals[1]);
        residuals[2] = rounded(steps[2]);
        rest[2] = steps[2] - residuals[2];
        shrink(residuals, rest, squared_bound);
    }
    return residuals;
}

LatticePoint SplitPrediction::reconstruct(const SplitTarget& target,
                                          const std::array<std::int32_t, 3>& residuals) const {
    Vector steps = {residuals[0] * kStep, residuals[1] * kStep, residuals[2] * kStep};
    if (target.axes == SplitTarget::Axes::kWorld) return nearest_point(plus(target.place, steps));
    const GateFrame& frame = *target.frame;
    Vector place = target.place;
    if (target.axes == SplitTarget::Axes::kCircle) {
        place = frame.origin;
        double radius = target.tangential[1] + steps[1];
        radius = radius > 0.0 ? radius : 0.0;
        UnitVector turn;  // what unit_vector(0) is
        if (residuals[2] != 0)
            turn = unit_vector(std::clamp(steps[2] / std::max(kLeastRadius, radius), -4.0, 4.0));
        const UnitVector& bend = target.bend;
        steps = {target.tangential[0] + steps[0],
                 radius * (bend.cosine * turn.cosine - bend.sine * turn.sine),
                 radius * (bend.cosine * turn.sine + bend.sine * turn.cosine)};
    }
    for (std::size_t c = 0; c < 3; ++c)
        place[c] = place[c] + frame.x[c] * steps[0] + frame.y[c] * steps[1] + frame.z[c] * steps[2];
    return nearest_point(place);
}

void SplitPrediction::record(std::size_t place, const std::array<std::int32_t, 3>& residuals,
                             const LatticePoint& decoded) {
    points_[place] = decoded;
    Vector& point = now_[place];
    for (std::size_t c = 0; c < 3; ++c) point[c] = decoded[c];
    if (keeps_local_) remember(place, point);
    for (std::size_t c = 0; c < 3; ++c) {
        const auto size = static_cast<std::int32_t>(
            std::min<std::int64_t>(std::abs(std::int64_t{residuals[c]}) * kSizeUnit, kLargestSize));
        sizes_[place][c] = size;
        means_[place][c] += (size - means_[place][c] + 2) >> 2;
    }
}

}  // namespace batchenc
