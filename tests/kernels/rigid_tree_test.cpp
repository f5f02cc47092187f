#include "kernels/rigid_tree.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

namespace batchenc {
namespace {

using Vector = std::array<double, 3>;
using Matrix = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

Matrix matrix_of(const std::array<double, 9>& rotation) { return Eigen::Map<const Matrix>(rotation.data()); }
Eigen::Vector3d vector_of(const Vector& v) { return {v[0], v[1], v[2]}; }

Matrix eigen_rotation(const Eigen::Vector3d& v) {
    const double angle = v.norm();
    return angle > 0.0 ? Eigen::AngleAxisd(angle, v / angle).toRotationMatrix() : Matrix::Identity();
}

/// Turns by a vector about a place.
BodyMotion turn_about(const Eigen::Vector3d& vector, const Eigen::Vector3d& place) {
    BodyMotion motion;
    Eigen::Map<Matrix>(motion.rotation.data()) = eigen_rotation(vector);
    Eigen::Map<Eigen::Vector3d>(motion.translation.data()) = place - eigen_rotation(vector) * place;
    return motion;
}

void expect_near(const Vector& a, const Vector& b, double tolerance) {
    for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(a[k], b[k], tolerance) << "coordinate " << k;
}

TEST(RotationOf, IsThatOfAngleAndAxis) {
    std::mt19937 random(1);
    std::normal_distribution<double> normal;
    for (int i = 0; i < 2000; ++i) {
        const double size = std::exp2(static_cast<double>(i % 20) - 14.0);
        const Eigen::Vector3d v = size * Eigen::Vector3d(normal(random), normal(random), normal(random));
        EXPECT_LT((matrix_of(rotation_of({v[0], v[1], v[2]})) - eigen_rotation(v)).norm(), 1e-9) << v;
    }
    EXPECT_EQ(rotation_of({0, 0, std::numbers::pi / 2})[0], rotation_of({std::numbers::pi / 2, 0, 0})[4]);
}

TEST(RotationOf, IsTheIdentityWhereThereIsNoAngle) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    for (const Vector& v : {Vector{0, 0, 0}, Vector{nan, 0, 1}, Vector{1e7, 0, 0}, Vector{0, 1e300, 1e300}})
        EXPECT_EQ(rotation_of(v), BodyMotion().rotation);
}

TEST(RotationVector, StaysNearTheLastOverWholeTurns) {
    const Vector axis = {0.48, -0.6, 0.64};
    Vector last{};
    for (int k = 1; k < 200; ++k) {  // ten turns up, and back
        const double angle = (k < 100 ? k : 200 - k) * 0.2 * std::numbers::pi;
        const Vector wanted = {angle * axis[0], angle * axis[1], angle * axis[2]};
        last = rotation_vector(rotation_of(wanted), last);
        if (k % 10 != 0)
            expect_near(last, wanted, 1e-9);  // whole turns have any axis
        else
            last = wanted;
        EXPECT_LT((matrix_of(rotation_of(last)) - matrix_of(rotation_of(wanted))).norm(), 1e-10);
    }
    expect_near(rotation_vector(BodyMotion().rotation, {0, 0, 0}), {0, 0, 0}, 0.0);
}

TEST(BodyMotion, ComposesAndTakesApart) {
    std::mt19937 random(2);
    std::normal_distribution<double> normal;
    const auto draw = [&] {
        BodyMotion motion;
        motion.rotation = rotation_of({normal(random), normal(random), normal(random)});
        motion.translation = {normal(random), normal(random), normal(random)};
        return motion;
    };
    for (int i = 0; i < 100; ++i) {
        const BodyMotion parent = draw(), child = draw();
        const Vector rest = {normal(random), normal(random), normal(random)};
        const Eigen::Vector3d by_hand =
            matrix_of(child.rotation) * vector_of(rest) + vector_of(child.translation);
        expect_near(child.apply(rest), {by_hand[0], by_hand[1], by_hand[2]}, 1e-14);
        expect_near(parent.after(child).apply(rest), parent.apply(child.apply(rest)), 1e-13);
        expect_near(parent.after(child.relative_to(parent)).apply(rest), child.apply(rest), 1e-8);
        // The LCF leads back: T (p - o) = r.
        const LocalFrame frame = child.local_frame();
        const Eigen::Vector3d back =
            matrix_of(frame.rotation) * (vector_of(child.apply(rest)) - vector_of(frame.origin));
        expect_near({back[0], back[1], back[2]}, rest, 1e-8);
    }
}

constexpr int kFrames = 40;

/// An arm: the upper bone turns far about the origin, the lower one a little about the elbow at (1, 0, 0),
/// and a third body hovers.
std::vector<RigidBody> arm() {
    std::vector<RigidBody> bodies(3);
    bodies[0].center = {1.5, 0, 0};  // lower bone first, so that the order has something to do
    bodies[1].center = {0.5, 0, 0};
    bodies[2].center = {0, 5, 0};
    for (RigidBody& body : bodies) {
        body.radius = 0.3;
        body.vertex_count = 10;
    }
    for (int f = 0; f < kFrames; ++f) {
        const double t = 0.15 * f;
        const BodyMotion upper = turn_about({0.2 * std::sin(t), 0.3 * t, 1.5 * std::sin(0.7 * t)}, {0, 0, 0});
        const BodyMotion elbow =
            turn_about({0.02 * std::sin(2 * t), 0.03 * std::cos(3 * t), 0.3 * std::sin(t)}, {1, 0, 0});
        bodies[0].track.push_back(upper.after(elbow));
        bodies[1].track.push_back(upper);
        BodyMotion hover;
        hover.translation[1] = 0.01 * std::sin(t);
        bodies[2].track.push_back(hover);
    }
    return bodies;
}

TEST(RigidTree, HangsTheLowerBoneOnTheUpper) {
    const std::vector<RigidBody> bodies = arm();
    const RigidTree tree = RigidTree::of(bodies);
    EXPECT_EQ(tree.parent[0], 1);
    EXPECT_EQ(tree.parent[2], -1);
    EXPECT_NE(tree.parent[1], 0);
    EXPECT_EQ(tree.order.size(), 3u);
    EXPECT_EQ(tree.order, RigidTree::order_of(tree.parent));
}

TEST(RigidTree, OneFrameHangsOnTheWorld) {
    std::vector<RigidBody> bodies = arm();
    for (RigidBody& body : bodies) body.track.resize(1);
    const RigidTree tree = RigidTree::of(bodies);
    EXPECT_EQ(tree.parent, (std::vector<std::int32_t>{-1, -1, -1}));
    EXPECT_EQ(tree.order, (std::vector<std::int32_t>{0, 1, 2}));
    EXPECT_TRUE(RigidTree::of({}).order.empty());
}

TEST(RigidTree, OrdersParentsFirstAndRefusesCycles) {
    using List = std::vector<std::int32_t>;
    EXPECT_EQ(RigidTree::order_of(List{-1}), (List{0}));
    EXPECT_EQ(RigidTree::order_of(List{-1, 0, 0, 1}), (List{0, 1, 2, 3}));
    EXPECT_EQ(RigidTree::order_of(List{3, -1, 0, 1}), (List{1, 3, 0, 2}));
    EXPECT_TRUE(RigidTree::order_of(List{0}).empty());
    EXPECT_TRUE(RigidTree::order_of(List{1, 0}).empty());
    EXPECT_TRUE(RigidTree::order_of(List{-1, 2, 3, 1}).empty());
}

TEST(JointOf, FindsTheHinge) {
    const std::vector<RigidBody> bodies = arm();
    BodyTrack relative;
    for (int f = 0; f < kFrames; ++f) {
        const auto at = static_cast<std::size_t>(f);
        relative.push_back(bodies[0].track[at].relative_to(bodies[1].track[at]));
    }
    // What turns about one axis above all says little of where along it the joint is, but enough.
    expect_near(joint_of(relative, {1.5, 0.2, 0.4}, 0.3), {1, 0, 0}, 0.12);
    expect_near(joint_of(relative, {1.5, 0, 0}, 0.3), {1, 0, 0}, 0.01);
}

TEST(JointOf, KeepsTheCentreWhereThereIsNone) {
    BodyTrack slides, far;
    for (int f = 0; f < kFrames; ++f) {
        slides.emplace_back();
        slides.back().translation[0] = 0.1 * f;
        far.push_back(turn_about({0, 0, 0.001 * f}, {1000, 0, 0}));
    }
    expect_near(joint_of(slides, {1, 2, 3}, 0.5), {1, 2, 3}, 1e-9);
    expect_near(joint_of(far, {1, 2, 3}, 0.5), {1, 2, 3}, 0.0);
}

}  // namespace
}  // namespace batchenc
