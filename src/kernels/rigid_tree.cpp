#include "kernels/rigid_tree.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "kernels/steady_math.h"
#include "kernels/vector3.h"

namespace batchenc {
namespace {

using Vector = std::array<double, 3>;
using Rotation = std::array<double, 9>;

constexpr std::int64_t kMostSteps = 64;  // from frame to frame, that the tree looks at

Vector rotate(const Rotation& r, const Vector& p) {
    return {r[0] * p[0] + r[1] * p[1] + r[2] * p[2], r[3] * p[0] + r[4] * p[1] + r[5] * p[2],
            r[6] * p[0] + r[7] * p[1] + r[8] * p[2]};
}

Vector rotate_back(const Rotation& r, const Vector& p) {
    return {r[0] * p[0] + r[3] * p[1] + r[6] * p[2], r[1] * p[0] + r[4] * p[1] + r[7] * p[2],
            r[2] * p[0] + r[5] * p[1] + r[8] * p[2]};
}

template <typename Turn>
Rotation turn_columns(const Rotation& b, Turn turn) {
    Rotation result;
    for (std::size_t column = 0; column < 3; ++column) {
        const Vector turned = turn(Vector{b[column], b[3 + column], b[6 + column]});
        for (std::size_t row = 0; row < 3; ++row) result[3 * row + column] = turned[row];
    }
    return result;
}

template <std::size_t N>
double squared_step(const std::array<double, N>& a, const std::array<double, N>& b) {
    double sum = 0.0;
    for (std::size_t k = 0; k < N; ++k) sum += (a[k] - b[k]) * (a[k] - b[k]);
    return sum;
}

/// Squared steps of a body's vertices, on the average, in the frame of `parent` or, without one, the world.
double motion_against(const RigidBody& body, const BodyTrack* parent) {
    const auto frames = static_cast<std::int64_t>(body.track.size());
    const std::int64_t steps = std::min(kMostSteps, frames - 1);
    double sum = 0.0;
    for (std::int64_t k = 0; k < steps; ++k) {
        const auto f = static_cast<std::size_t>(k * (frames - 1) / steps);
        BodyMotion before = body.track[f], after = body.track[f + 1];
        if (parent != nullptr) {
            before = before.relative_to((*parent)[f]);
            after = after.relative_to((*parent)[f + 1]);
        }
        sum += squared_step(before.apply(body.center), after.apply(body.center)) +
               0.5 * body.radius * body.radius * squared_step(before.rotation, after.rotation);
    }
    return sum;
}

}  // namespace

Vector BodyMotion::apply(const Vector& rest) const { return plus(rotate(rotation, rest), translation); }

BodyMotion BodyMotion::after(const BodyMotion& first) const {
    return {turn_columns(first.rotation, [&](const Vector& v) { return rotate(rotation, v); }),
            apply(first.translation)};
}

BodyMotion BodyMotion::relative_to(const BodyMotion& parent) const {
    return {turn_columns(rotation, [&](const Vector& v) { return rotate_back(parent.rotation, v); }),
            rotate_back(parent.rotation, minus(translation, parent.translation))};
}

BodyMotion BodyMotion::moved_by(const std::array<float, 3>& way) const {
    BodyMotion moved = *this;
    moved.translation = plus(translation, {way[0], way[1], way[2]});
    return moved;
}

BodyMotion BodyMotion::of(const LocalFrameTrack& track, std::int64_t frame) {
    BodyMotion motion;
    for (std::size_t row = 0; row < 3; ++row) {
        for (std::size_t column = 0; column < 3; ++column)
            motion.rotation[3 * row + column] =
                static_cast<double>(track.row(static_cast<int>(3 * column + row))[frame]);
        motion.translation[row] = static_cast<double>(track.row(static_cast<int>(9 + row))[frame]);
    }
    return motion;
}

LocalFrame BodyMotion::local_frame() const {
    LocalFrame frame;
    for (std::size_t row = 0; row < 3; ++row) {
        for (std::size_t column = 0; column < 3; ++column)
            frame.rotation[3 * row + column] = rotation[3 * column + row];
    }
    frame.origin = translation;
    return frame;
}

Rotation rotation_of(const Vector& v) {
    const double angle = norm(v);
    if (!(angle > 0.0 && angle < 1e6)) return Rotation{1, 0, 0, 0, 1, 0, 0, 0, 1};
    constexpr double kTurn = 2.0 * std::numbers::pi;
    const UnitVector unit = unit_vector(angle - kTurn * std::floor(angle / kTurn));
    const Vector k = {v[0] / angle, v[1] / angle, v[2] / angle};
    const double c = unit.cosine, s = unit.sine, d = 1.0 - c;
    return {c + d * k[0] * k[0],        d * k[0] * k[1] - s * k[2], d * k[0] * k[2] + s * k[1],
            d * k[0] * k[1] + s * k[2], c + d * k[1] * k[1],        d * k[1] * k[2] - s * k[0],
            d * k[0] * k[2] - s * k[1], d * k[1] * k[2] + s * k[0], c + d * k[2] * k[2]};
}

Vector rotation_vector(const Rotation& rotation, const Vector& near) {
    Eigen::Matrix3d matrix;
    for (Eigen::Index row = 0; row < 3; ++row) {
        for (Eigen::Index column = 0; column < 3; ++column)
            matrix(row, column) = rotation[static_cast<std::size_t>(3 * row + column)];
    }
    const Eigen::AngleAxisd turn(matrix);
    double angle = turn.angle();
    Vector axis = {turn.axis()[0], turn.axis()[1], turn.axis()[2]};
    const double along = dot(axis, near);
    // A rotation by nothing is one by whole turns about any axis: stay near the last.
    constexpr double kTurn = 2.0 * std::numbers::pi;
    angle += kTurn * std::floor((along - angle) / kTurn + 0.5);
    return times(angle, axis);
}

RigidTree RigidTree::of(std::span<const RigidBody> bodies) {
    const std::size_t count = bodies.size();
    RigidTree tree;
    tree.parent.assign(count, -1);
    if (count <= kMostBodies) {
        std::vector<double> distance(count);
        std::vector<std::uint8_t> joined(count, 0);
        for (std::size_t i = 0; i < count; ++i) distance[i] = motion_against(bodies[i], nullptr);
        for (std::size_t round = 0; round < count; ++round) {
            std::size_t next = count;
            for (std::size_t i = 0; i < count; ++i) {
                if (joined[i] == 0 && (next == count || distance[i] < distance[next])) next = i;
            }
            joined[next] = 1;
            for (std::size_t i = 0; i < count; ++i) {
                if (joined[i] != 0) continue;
                const double against = motion_against(bodies[i], &bodies[next].track);
                if (against < distance[i]) {
                    distance[i] = against;
                    tree.parent[i] = static_cast<std::int32_t>(next);
                }
            }
        }
    }
    tree.order = order_of(tree.parent);
    return tree;
}

std::vector<std::int32_t> RigidTree::order_of(std::span<const std::int32_t> parent) {
    std::vector<std::int32_t> first(parent.size() + 2, 0), children(parent.size());
    for (const std::int32_t p : parent) ++first[static_cast<std::size_t>(p + 1) + 1];
    for (std::size_t k = 1; k < first.size(); ++k) first[k] += first[k - 1];
    std::vector<std::int32_t> at(first.begin(), first.end() - 1);
    for (std::size_t i = 0; i < parent.size(); ++i)
        children[static_cast<std::size_t>(at[static_cast<std::size_t>(parent[i] + 1)]++)] =
            static_cast<std::int32_t>(i);
    std::vector<std::int32_t> order;
    order.reserve(parent.size());
    const auto append_children = [&](std::int32_t p) {
        const auto slot = static_cast<std::size_t>(p + 1);
        order.insert(order.end(), children.begin() + first[slot], children.begin() + first[slot + 1]);
    };
    append_children(-1);
    for (std::size_t k = 0; k < order.size(); ++k) append_children(order[k]);
    if (order.size() != parent.size()) order.clear();
    return order;
}

Vector joint_of(const BodyTrack& track, const Vector& center, double radius) {
    // Least squares of R a + t - (mean of it) over the frames, and a little of a - centre.
    const auto frames = static_cast<double>(track.size());
    using Matrix = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
    Matrix mean_rotation = Matrix::Zero(), squares = Matrix::Zero();
    Eigen::Vector3d mean_translation = Eigen::Vector3d::Zero(), products = Eigen::Vector3d::Zero();
    for (const BodyMotion& motion : track) {
        mean_rotation += Eigen::Map<const Matrix>(motion.rotation.data()) / frames;
        mean_translation += Eigen::Map<const Eigen::Vector3d>(motion.translation.data()) / frames;
    }
    for (const BodyMotion& motion : track) {
        const Matrix turned = Eigen::Map<const Matrix>(motion.rotation.data()) - mean_rotation;
        const Eigen::Vector3d moved =
            Eigen::Map<const Eigen::Vector3d>(motion.translation.data()) - mean_translation;
        squares += turned.transpose() * turned;
        products += turned.transpose() * moved;
    }
    const Eigen::Vector3d middle = Eigen::Map<const Eigen::Vector3d>(center.data());
    const double ridge = 1e-3 * squares.trace() / 3.0 + 1e-12;
    const Eigen::Vector3d joint =
        (squares + ridge * Matrix::Identity()).ldlt().solve(ridge * middle - products);
    constexpr double kFarthest = 4.0;  // radii; a joint beyond is none
    if (!joint.allFinite() || !((joint - middle).norm() < kFarthest * radius)) return center;
    return {joint[0], joint[1], joint[2]};
}

}  // namespace batchenc
