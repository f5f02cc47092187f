#include <algorithm>
#include <cmath>

#include "kernels/synthetic_kinds.h"

// A figure of six closed tubes on thirteen bones that walks along a winding path. In rest it stands at the
// origin and looks along x, with y to its left. A ring of a tube belongs to one bone, or near a joint to two
// with weights that change smoothly (linear blend skinning), and swells a little as the figure treads.

namespace batchenc {
namespace {

constexpr double kPi = 3.141592653589793;

enum Bone : std::size_t { kPelvis, kChest, kHead, kArm, kForearm, kThigh, kShin, kFoot, kOneSide = 8 };
constexpr std::size_t kBones = 13;  // pelvis, chest, head, five of the left side and five of the right
constexpr std::size_t on_side(Bone bone, bool right) { return bone + (right ? kOneSide - kArm : 0); }

double smooth_step(double x) {
    x = std::clamp(x, 0.0, 1.0);
    return x * x * (3.0 - 2.0 * x);
}

// One closed tube in rest. Lengths in metres; places along it as parts of its length.
struct TubeShape {
    std::array<double, 3> start;
    double length,
        angle;  // of its axis in the x-z plane, from downwards (0) by forwards (pi/2) to upwards (pi)
    double bend_begin = 1.0, bend_end = 1.0, bend = 0.0;  // where the axis turns, and by how much
    std::array<double, 5> width, depth;                   // radii at equal distances, sideways and across
    std::vector<std::size_t> bones;
    std::vector<double> joints;  // where the next bone takes over
    double share;                // of the figure's vertices
};

double radius_at(const std::array<double, 5>& radii, double place) {
    const double x = std::clamp(place, 0.0, 1.0) * 4.0;
    const auto i = static_cast<std::size_t>(std::min(x, 3.0));
    const double round = 0.18;  // the ends are half ellipses
    const double from_end = std::min({place / round, (1.0 - place) / round, 1.0});
    return (radii[i] + (radii[i + 1] - radii[i]) * smooth_step(x - static_cast<double>(i))) *
           std::sqrt(std::max(0.0, from_end * (2.0 - from_end)));
}

struct Ring {
    std::size_t first_bone, second_bone;
    float second_weight;
    double place;        // along its tube, 0 … 1
    std::int64_t count;  // of vertices: one at a pole
};

struct TubeSize {
    std::int64_t rings, sides;
    std::int64_t vertex_count() const { return rings * sides + 2; }
};

TubeSize choose_size(const TubeShape& shape, double vertex_count) {
    const double around = kPi * (shape.width[2] + shape.depth[2]);
    const double ideal = std::sqrt(std::max(vertex_count - 2.0, 6.0) * around / shape.length);
    TubeSize best{};
    double best_cost = 1e300;
    for (auto sides = std::max<std::int64_t>(3, static_cast<std::int64_t>(0.7 * ideal));
         sides <= static_cast<std::int64_t>(1.4 * ideal) + 2; ++sides) {
        const auto rings =
            std::max<std::int64_t>(2, std::llround((vertex_count - 2.0) / static_cast<double>(sides)));
        const TubeSize size{rings, sides};
        const double miss = std::abs(static_cast<double>(size.vertex_count()) - vertex_count);
        const double cost =
            miss + 0.5 * std::abs(static_cast<double>(sides) / ideal - 1.0);  // shape decides ties
        if (cost < best_cost) {
            best_cost = cost;
            best = size;
        }
    }
    return best;
}

// How the figure walks.
struct Gait {
    std::array<double, 8> phases{};
    double cadence = 0.0;  // pairs of steps a second
    double stride = 0.0;   // metres a pair of steps
    double winding = 0.0;  // radians of the path's bends a metre
    double effort = 1.0;   // how far the limbs swing
    Ripples ripples;       // of the skin
};

Gait draw_gait(Dice& dice) {
    Gait gait;
    for (double& phase : gait.phases) phase = dice.phase();
    gait.cadence = dice.between(0.82, 0.98);
    gait.stride = dice.between(1.35, 1.5);
    gait.winding = dice.between(0.19, 0.26);
    return gait;
}

class Walker final : public Performer {
 public:
    Walker(std::int64_t vertex_count, std::uint64_t seed) {
        Dice dice(seed ^ 0x3A1C);
        const double build = dice.between(0.9, 1.15);  // how stout
        const double leg = dice.between(0.86, 0.96), trunk = dice.between(0.56, 0.62),
                     arm = dice.between(0.62, 0.7);
        const double shoulder = leg + trunk - 0.1;
        const auto joint = [](double x, double y, double z) {
            return Vector3{static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)};
        };
        joints_[kPelvis] = joint(0, 0, leg + 0.04);
        joints_[kChest] = joint(0, 0, leg + 0.45 * trunk);
        joints_[kHead] = joint(0, 0, leg + trunk + 0.04);
        for (const bool right : {false, true}) {
            const double side = right ? -1.0 : 1.0;
            joints_[on_side(kArm, right)] = joint(0, side * 0.21 * build, shoulder);
            joints_[on_side(kForearm, right)] = joint(0, side * 0.21 * build, shoulder - 0.48 * arm);
            joints_[on_side(kThigh, right)] = joint(0, side * 0.1 * build, leg);
            joints_[on_side(kShin, right)] = joint(0, side * 0.1 * build, 0.52 * leg);
            joints_[on_side(kFoot, right)] = joint(0, side * 0.1 * build, 0.09);
        }

        const auto radii = [build](std::array<double, 5> r) {
            for (double& x : r) x *= build;
            return r;
        };
        std::vector<TubeShape> shapes;
        shapes.push_back({.start = {0, 0, leg - 0.08},
                          .length = trunk + 0.1,
                          .angle = kPi,
                          .width = radii({0.15, 0.16, 0.14, 0.18, 0.1}),
                          .depth = radii({0.11, 0.11, 0.1, 0.12, 0.07}),
                          .bones = {kPelvis, kChest},
                          .joints = {0.5},
                          .share = 0.32});
        shapes.push_back({.start = {0, 0, leg + trunk - 0.02},
                          .length = 0.3,
                          .angle = kPi,
                          .width = radii({0.05, 0.075, 0.085, 0.085, 0.07}),
                          .depth = radii({0.06, 0.09, 0.1, 0.1, 0.08}),
                          .bones = {kChest, kHead},
                          .joints = {0.2},
                          .share = 0.14});
        for (const bool right : {false, true}) {
            const double side = right ? -1.0 : 1.0;
            shapes.push_back({.start = {0, side * 0.21 * build, shoulder + 0.07},
                              .length = arm + 0.16,
                              .angle = 0.0,
                              .width = radii({0.06, 0.05, 0.042, 0.032, 0.035}),
                              .depth = radii({0.06, 0.05, 0.045, 0.035, 0.045}),
                              .bones = {kChest, on_side(kArm, right), on_side(kForearm, right)},
                              .joints = {0.08, (0.48 * arm + 0.07) / (arm + 0.16)},
                              .share = 0.1});
            const double length = leg + 0.26;
            shapes.push_back(
                {.start = {-0.02, side * 0.1 * build, leg + 0.08},
                 .length = length,
                 .angle = 0.0,
                 .bend_begin = (leg - 0.06) / length,
                 .bend_end = (leg + 0.11) / length,
                 .bend = 0.5 * kPi,
                 .width = radii({0.085, 0.08, 0.055, 0.042, 0.045}),
                 .depth = radii({0.095, 0.085, 0.06, 0.045, 0.035}),
                 .bones = {kPelvis, on_side(kThigh, right), on_side(kShin, right), on_side(kFoot, right)},
                 .joints = {0.09, (0.48 * leg + 0.08) / length, leg / length},
                 .share = 0.17});
        }
        double wanted = 0.0;  // what rounding one tube takes or gives goes to the next
        for (const TubeShape& shape : shapes) {
            wanted += shape.share * static_cast<double>(vertex_count);
            const auto before = static_cast<double>(rest_.size());
            add_tube(shape, choose_size(shape, wanted), dice);
            wanted -= static_cast<double>(rest_.size()) - before;
        }
        gait_ = draw_gait(dice);
    }

    std::int64_t vertex_count() const override { return static_cast<std::int64_t>(rest_.size()); }
    const std::vector<Triangle>& triangles() const override { return triangles_; }
    double fps() const override { return 30.0; }

    void write_frame(std::int64_t frame, std::span<float> positions) const override {
        walk(gait_, static_cast<double>(frame) / fps(), positions);
    }

    // On the spot, slower or faster than it would by itself.
    void write_act(std::uint64_t act_seed, double time_s, std::span<float> positions) const override {
        Dice dice(act_seed);
        Gait gait = draw_gait(dice);
        gait.cadence *= dice.between(0.7, 1.3);
        gait.stride = 0.0;
        gait.winding = 1e6;  // a path of no length lies where it begins
        gait.effort = dice.between(0.5, 1.2);
        gait.ripples = Ripples(dice, 12, 0.005, 0.09);
        walk(gait, time_s, positions);
    }

 private:
    void walk(const Gait& gait, double t, std::span<float> positions) const {
        const double step = step_phase(gait, t);
        const auto bones = pose(gait, t, step);
        const auto ripples = gait.ripples.at(t);
        float* out = positions.data();
        std::size_t v = 0;
        for (const Ring& ring : rings_) {
            RigidMotion motion = bones[ring.first_bone];  // affine where two are blended
            if (ring.second_weight > 0.0f) {
                const RigidMotion& other = bones[ring.second_bone];
                const float w = ring.second_weight;
                for (std::size_t i = 0; i < 3; ++i) {
                    for (std::size_t j = 0; j < 3; ++j) {
                        motion.rotation[i][j] += w * (other.rotation[i][j] - motion.rotation[i][j]);
                    }
                    motion.offset[i] += w * (other.offset[i] - motion.offset[i]);
                }
            }
            const auto swell_of_ring =
                static_cast<float>(0.004 * std::sin(2.0 * step - 7.0 * ring.place + gait.phases[6]) +
                                   0.002 * std::sin(0.77 * t + gait.phases[7]));
            for (std::int64_t i = 0; i < ring.count; ++i, ++v) {
                const Vector3 &x = rest_[v], &n = outward_[v];
                const float swell = swell_of_ring + gait.ripples(x, ripples);
                const Vector3 p = motion({x[0] + swell * n[0], x[1] + swell * n[1], x[2] + swell * n[2]});
                out = std::copy(p.begin(), p.end(), out);
            }
        }
    }

    // Radians of the gait, two pi for two steps; its speed wanders slowly.
    static double step_phase(const Gait& gait, double t) {
        return 2.0 * kPi * gait.cadence * t + 0.5 * std::sin(0.371 * t + gait.phases[0]) +
               0.3 * std::sin(0.829 * t + gait.phases[1]);
    }

    std::array<RigidMotion, kBones> pose(const Gait& gait, double t, double step) const {
        std::array<RigidMotion, kBones> bones;
        const double effort = gait.effort * (1.0 + 0.12 * std::sin(0.233 * t + gait.phases[2]));

        // Along the path as far as the steps carry, so that the feet do not slide much.
        const double way = gait.stride * step / (2.0 * kPi);
        const double heading = 0.35 * std::cos(gait.winding * way + gait.phases[3]);
        RigidMotion& pelvis = bones[kPelvis];
        pelvis = rotation_about(2, heading + 0.07 * std::sin(step))
                     .after(rotation_about(1, 0.05 + 0.015 * std::sin(2.0 * step)))
                     .after(rotation_about(0, 0.04 * std::sin(step + 0.4)));
        const Vector3 hip = joints_[kPelvis];
        const std::array<double, 3> at = {
            way, 0.35 / gait.winding * std::sin(gait.winding * way + gait.phases[3]) + 0.02 * std::sin(step),
            hip[2] - 0.015 + 0.02 * std::cos(2.0 * step)};
        const Vector3 turned = pelvis.turn(hip);
        for (std::size_t i = 0; i < 3; ++i) pelvis.offset[i] = static_cast<float>(at[i]) - turned[i];

        const auto attach = [&](std::size_t child, std::size_t parent, const RigidMotion& rotation) {
            // about the joint, which the parent carries along
            const Vector3 joint = joints_[child];
            RigidMotion about = rotation;
            const Vector3 moved = rotation.turn(joint);
            for (std::size_t i = 0; i < 3; ++i) about.offset[i] = joint[i] - moved[i];
            bones[child] = bones[parent].after(about);
        };
        attach(kChest, kPelvis,
               rotation_about(2, -0.16 * effort * std::sin(step))
                   .after(rotation_about(1, 0.04 * std::sin(2.0 * step + 0.7))));
        attach(kHead, kChest,
               rotation_about(2, 0.09 * std::sin(step) +
                                     0.4 * std::sin(0.541 * t + gait.phases[4]) * std::sin(0.203 * t))
                   .after(rotation_about(1, 0.12 * std::sin(0.947 * t + gait.phases[5]))));
        for (const bool right : {false, true}) {
            const double side = right ? -1.0 : 1.0, s = right ? step + kPi : step;
            // Positive turns about y swing what hangs down to the back.
            attach(
                on_side(kThigh, right), kPelvis,
                rotation_about(1, -0.08 - 0.42 * effort * std::sin(s)).after(rotation_about(0, 0.03 * side)));
            const double lift = 0.5 * (1.0 + std::cos(s - 0.35));
            attach(on_side(kShin, right), on_side(kThigh, right),
                   rotation_about(1, 0.12 + 0.85 * effort * lift * lift));
            attach(on_side(kFoot, right), on_side(kShin, right),
                   rotation_about(1, -0.05 + 0.25 * std::sin(s - 1.2)));
            attach(
                on_side(kArm, right), kChest,
                rotation_about(1, 0.08 + 0.45 * effort * std::sin(s)).after(rotation_about(0, 0.12 * side)));
            attach(on_side(kForearm, right), on_side(kArm, right),
                   rotation_about(1, -0.4 - 0.22 * effort * (1.0 - std::sin(s + 0.3))));
        }
        return bones;
    }

    void add_tube(const TubeShape& shape, const TubeSize& size, Dice& dice) {
        const auto pole = static_cast<std::int32_t>(rest_.size());
        std::array<double, 3> centre = shape.start;
        double reached = 0.0;
        const auto angle_at = [&shape](double place) {
            return shape.angle + shape.bend * smooth_step((place - shape.bend_begin) /
                                                          (shape.bend_end - shape.bend_begin + 1e-9));
        };
        const auto advance = [&](double place) {  // along the axis, in steps short enough for its bend
            constexpr int kSteps = 32;
            const double stretch = (place - reached) / kSteps;
            for (int i = 0; i < kSteps; ++i) {
                const double angle = angle_at(reached + (i + 0.5) * stretch);
                centre[0] += shape.length * stretch * std::sin(angle);
                centre[2] -= shape.length * stretch * std::cos(angle);
            }
            reached = place;
        };
        const auto add = [&](double sideways, double across, double side_normal, double across_normal,
                             double along_normal) {
            const double angle = angle_at(reached), c = std::cos(angle), s = std::sin(angle);
            // across the axis (cos, 0, sin), along it (sin, 0, -cos)
            rest_.push_back({static_cast<float>(centre[0] + across * c),
                             static_cast<float>(centre[1] + sideways),
                             static_cast<float>(centre[2] + across * s)});
            outward_.push_back({static_cast<float>(across_normal * c + along_normal * s),
                                static_cast<float>(side_normal),
                                static_cast<float>(across_normal * s - along_normal * c)});
        };
        const double bulge = dice.between(0.03, 0.08), turn = dice.phase(), shift = dice.phase();
        for (std::int64_t r = 0; r <= size.rings + 1; ++r) {
            const double place = static_cast<double>(r) / static_cast<double>(size.rings + 1);
            advance(place);
            const bool is_pole = r == 0 || r == size.rings + 1;
            rings_.push_back(make_ring(shape, place, is_pole ? 1 : size.sides));
            if (is_pole) {
                add(0, 0, 0, 0, r == 0 ? -1.0 : 1.0);
                continue;
            }
            const double width = radius_at(shape.width, place), depth = radius_at(shape.depth, place);
            for (std::int64_t i = 0; i < size.sides; ++i) {
                const double phi = 2.0 * kPi * (static_cast<double>(i) + 0.5 * static_cast<double>(r % 2)) /
                                       static_cast<double>(size.sides) +
                                   turn;
                const double wave = 1.0 + bulge * std::sin(2.0 * phi + shift + 5.0 * place);
                add(width * wave * std::sin(phi), depth * wave * std::cos(phi), std::sin(phi), std::cos(phi),
                    0.0);
            }
        }
        add_triangles(pole, size);
    }

    static Ring make_ring(const TubeShape& shape, double place, std::int64_t count) {
        constexpr double kBlend = 0.07;  // half width of a joint, part of the tube's length
        std::size_t bone = 0;
        while (bone < shape.joints.size() && place > shape.joints[bone] + kBlend) ++bone;
        if (bone == shape.joints.size()) return {shape.bones[bone], shape.bones[bone], 0.0f, place, count};
        const double weight = smooth_step((place - shape.joints[bone] + kBlend) / (2.0 * kBlend));
        return {shape.bones[bone], shape.bones[bone + 1], static_cast<float>(weight), place, count};
    }

    // From the vertices of a tube, pole to pole, counter-clockwise seen from outside.
    void add_triangles(std::int32_t pole, const TubeSize& size) {
        const auto sides = static_cast<std::int32_t>(size.sides),
                   rings = static_cast<std::int32_t>(size.rings);
        const auto at = [&](std::int32_t ring, std::int32_t i) {
            return pole + 1 + ring * sides + i % sides;
        };
        for (std::int32_t i = 0; i < sides; ++i) triangles_.push_back({pole, at(0, i), at(0, i + 1)});
        for (std::int32_t r = 0; r + 1 < rings; ++r) {
            for (std::int32_t i = 0; i < sides; ++i) {
                // odd rings stand half a side further, so the shorter diagonal changes from ring to ring
                const std::int32_t a = at(r, i), b = at(r, i + 1), c = at(r + 1, i), d = at(r + 1, i + 1);
                if (r % 2 == 0) {
                    triangles_.push_back({a, d, b});
                    triangles_.push_back({a, c, d});
                } else {
                    triangles_.push_back({a, c, b});
                    triangles_.push_back({b, c, d});
                }
            }
        }
        const std::int32_t last = pole + 1 + rings * sides;
        for (std::int32_t i = 0; i < sides; ++i)
            triangles_.push_back({last, at(rings - 1, i + 1), at(rings - 1, i)});
    }

    std::array<Vector3, kBones> joints_{};  // where each bone is hinged, in rest
    std::vector<Ring> rings_;
    std::vector<Vector3> rest_, outward_;
    std::vector<Triangle> triangles_;
    Gait gait_;
};

}  // namespace

std::unique_ptr<Performer> make_walker(std::int64_t vertex_count, std::uint64_t seed) {
    return std::make_unique<Walker>(vertex_count, seed);
}

}  // namespace batchenc
