#include "kernels/steady_math.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace batchenc {
namespace {

constexpr double kClose = 1e-8;

TEST(SteadyMath, AgreesWithTheLibrary) {
    std::mt19937 generator(1);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    for (int i = 0; i < 20000; ++i) {
        const double angle = 6.283 * unit(generator);
        const UnitVector v = unit_vector(angle);
        ASSERT_NEAR(v.cosine, std::cos(angle), kClose);
        ASSERT_NEAR(v.sine, std::sin(angle), kClose);
        const double x = unit(generator), y = unit(generator);
        ASSERT_NEAR(angle_of(x, y), std::atan2(y, x), kClose);
        const double base = std::exp(20.0 * unit(generator)), exponent = 8.0 * unit(generator);
        ASSERT_NEAR(power(base, exponent) / std::pow(base, exponent), 1.0, kClose);
        const double value = std::exp(30.0 * unit(generator)) * (unit(generator) < 0.0 ? -1.0 : 1.0);
        ASSERT_NEAR(cube_root(value) / std::cbrt(value), 1.0, kClose);
    }
}

TEST(SteadyMath, HandWorkedValues) {
    EXPECT_EQ(unit_vector(0.0).cosine, 1.0);
    EXPECT_EQ(unit_vector(0.0).sine, 0.0);
    EXPECT_EQ(angle_of(0.0, 0.0), 0.0);
    EXPECT_NEAR(angle_of(-1.0, 0.0), 3.141592653589793, kClose);
    EXPECT_NEAR(angle_of(0.0, -2.0), -1.5707963267948966, kClose);
    EXPECT_NEAR(power(4.0, -0.5), 0.5, kClose);
    EXPECT_NEAR(power(7.0, 0.0), 1.0, kClose);
    EXPECT_EQ(cube_root(0.0), 0.0);
    EXPECT_NEAR(cube_root(-27.0), -3.0, kClose);
}

std::vector<double> roots_of(const std::array<double, 5>& c) {
    std::array<double, 4> roots;
    const int count = solve_quartic(c, roots);
    std::vector<double> found(roots.begin(), roots.begin() + count);
    std::sort(found.begin(), found.end());
    return found;
}

void expect_roots(const std::array<double, 5>& c, const std::vector<double>& expected) {
    const std::vector<double> found = roots_of(c);
    ASSERT_EQ(found.size(), expected.size());
    for (std::size_t k = 0; k < found.size(); ++k) EXPECT_NEAR(found[k], expected[k], 1e-6);
}

TEST(SteadyMath, QuarticsByHand) {
    expect_roots({24, -50, 35, -10, 1}, {1, 2, 3, 4});
    expect_roots({-4, 0, 3, 0, 1}, {-1, 1});  // t^4 + 3 t^2 - 4, without a linear term
    expect_roots({4, 0, -5, 0, 1}, {-2, -1, 1, 2});
    expect_roots({1, 0, 0, 0, 1}, {});  // none is real
    expect_roots({5, 0, 1, 0, 1}, {});
    expect_roots({-6, 11, -6, 1, 0}, {1, 2, 3});  // a cubic
    expect_roots({-2, 1, 1, 0, 0}, {-2, 1});      // a quadratic
    expect_roots({-3, 2, 0, 0, 0}, {1.5});        // a line
    expect_roots({1, 0, 0, 0, 0}, {});
    expect_roots({0, 0, 0, 0, 0}, {});
    expect_roots({std::nan(""), 0, 0, 0, 1}, {});
}

TEST(SteadyMath, QuarticsFromTheirRoots) {
    std::mt19937 generator(2);
    std::uniform_real_distribution<double> place(-3.0, 3.0);
    int wrong = 0;
    for (int i = 0; i < 20000; ++i) {
        std::vector<double> roots(4);
        for (double& root : roots) root = place(generator);
        std::sort(roots.begin(), roots.end());
        std::array<double, 5> c = {1, 0, 0, 0, 0};
        for (const double root : roots) {
            for (std::size_t k = 4; k > 0; --k) c[k] = c[k - 1] - root * c[k];
            c[0] *= -root;
        }
        const std::vector<double> found = roots_of(c);
        if (found.size() != 4) {
            ++wrong;  // roots that nearly coincide may be taken for none
            continue;
        }
        for (std::size_t k = 0; k < 4; ++k) ASSERT_NEAR(found[k], roots[k], 1e-4);
    }
    EXPECT_LE(wrong, 3);
}

}  // namespace
}  // namespace batchenc
