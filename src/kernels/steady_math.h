#pragma once

#include <array>

namespace batchenc {

// Elementary functions from + - * / and square roots in a fixed order, for closed loops: libm's differ
// between machines. Good to about 1e-9, which no prediction notices; the same bits everywhere.

/// Cosine and sine. angle: radians, |angle| <= 2 pi.
struct UnitVector {
    double cosine = 1.0, sine = 0.0;
};
UnitVector unit_vector(double angle);
/// The angle of a direction, -pi … pi; 0 for none.
double angle_of(double x, double y);
/// base^exponent; base > 0 and finite, |exponent| <= 16.
double power(double base, double exponent);
double cube_root(double value);

/// Real roots of c[4] t^4 + c[3] t^3 + c[2] t^2 + c[1] t + c[0], in closed form (Ferrari, Cardano) and each
/// mended by two steps of Newton's; leading coefficients that vanish beside the others are left out. Returns
/// how many roots stand in `roots`.
int solve_quartic(const std::array<double, 5>& c, std::array<double, 4>& roots);

}  // namespace batchenc
