#include "kernels/steady_math.h"

#include <bit>
#include <cfloat>
#include <cmath>
#include <cstdint>

// What encoders and decoders both compute rests on every operation being rounded by itself, here and in all
// other files that are built alike. -ffp-contract=off comes with the layers (cmake/Layer.cmake).
#ifdef __FAST_MATH__
#error "with -ffast-math decoders would find other numbers than encoders did"
#endif
static_assert(FLT_EVAL_METHOD == 0, "float and double must be computed in their own precision");

namespace batchenc {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kLn2 = 0.69314718055994530942;
constexpr double kNegligible = 1e-7;  // of a leading coefficient, beside the largest

double mend(const std::array<double, 5>& c, double t) {
    for (int step = 0; step < 2; ++step) {
        const double value = (((c[4] * t + c[3]) * t + c[2]) * t + c[1]) * t + c[0];
        const double slope = ((4.0 * c[4] * t + 3.0 * c[3]) * t + 2.0 * c[2]) * t + c[1];
        if (!(slope * slope > 1e-24)) return t;
        t -= value / slope;
    }
    return t;
}

/// Roots of a t^2 + b t + c.
int solve_quadratic(double a, double b, double c, double* roots) {
    if (a == 0.0) {
        if (b == 0.0) return 0;
        roots[0] = -c / b;
        return 1;
    }
    const double discriminant = b * b - 4.0 * a * c;
    if (!(discriminant >= 0.0)) return 0;
    const double root = std::sqrt(discriminant);
    const double q = -0.5 * (b < 0.0 ? b - root : b + root);
    roots[0] = q / a;
    if (q == 0.0) return 1;
    roots[1] = c / q;
    return 2;
}

/// Roots of t^3 + a t^2 + b t + c; the first is the largest.
int solve_cubic(double a, double b, double c, double* roots) {
    const double third = a / 3.0;
    const double p = (b - a * third) / 3.0;
    const double q = (2.0 * third * third * third - b * third + c) / 2.0;
    const double discriminant = q * q + p * p * p;
    if (discriminant >= 0.0) {
        const double root = std::sqrt(discriminant);
        const double u = cube_root(q > 0.0 ? -q - root : -q + root);
        roots[0] = (u == 0.0 ? 0.0 : u - p / u) - third;
        return 1;
    }
    const double size = std::sqrt(-p);
    const double angle = angle_of(-q, std::sqrt(-discriminant)) / 3.0;
    for (int k = 0; k < 3; ++k)
        roots[k] = 2.0 * size * unit_vector(angle - 2.0 * kPi / 3.0 * k).cosine - third;
    return 3;
}

}  // namespace

UnitVector unit_vector(double angle) {
    // A sixteenth of the angle by its series, doubled back.
    const double small = angle / 16.0;
    const double square = small * small;
    double sine =
        small * (1.0 - square / 6.0 * (1.0 - square / 20.0 * (1.0 - square / 42.0 * (1.0 - square / 72.0))));
    double versed =
        square / 2.0 * (1.0 - square / 12.0 * (1.0 - square / 30.0 * (1.0 - square / 56.0)));  // 1 - cosine
    for (int k = 0; k < 4; ++k) {
        const double cosine = 1.0 - versed;
        versed = 2.0 * sine * sine;
        sine = 2.0 * sine * cosine;
    }
    return {1.0 - versed, sine};
}

double angle_of(double x, double y) {
    const double ax = x < 0.0 ? -x : x, ay = y < 0.0 ? -y : y;
    if (!(ax + ay > 0.0)) return 0.0;
    // Twice the half angle's tangent's, which is at most tan(pi / 8) after one more halving.
    const double low = ax < ay ? ax : ay, high = ax < ay ? ay : ax;
    double t = low / high;
    t = t / (1.0 + std::sqrt(1.0 + t * t));
    t = t / (1.0 + std::sqrt(1.0 + t * t));
    const double s = t * t;
    double angle =
        4.0 * t *
        (1.0 - s * (1.0 / 3 - s * (1.0 / 5 - s * (1.0 / 7 - s * (1.0 / 9 - s * (1.0 / 11 - s / 13))))));
    if (ax < ay) angle = kPi / 2.0 - angle;
    if (x < 0.0) angle = kPi - angle;
    return y < 0.0 ? -angle : angle;
}

double power(double base, double exponent) {
    const auto bits = std::bit_cast<std::uint64_t>(base);
    const int octave = static_cast<int>(bits >> 52) - 1023;
    const double m = std::bit_cast<double>((bits & 0xfffffffffffffULL) | 0x3ff0000000000000ULL);
    const double t = (m - 1.4142135623730951) / (m + 1.4142135623730951), s = t * t;
    const double log2_of =
        octave + 0.5 +
        2.0 / kLn2 * t * (1.0 + s * (1.0 / 3 + s * (1.0 / 5 + s * (1.0 / 7 + s * (1.0 / 9 + s / 11)))));
    double wanted = log2_of * exponent;
    wanted = wanted > -1000.0 ? (wanted < 1000.0 ? wanted : 1000.0) : -1000.0;
    const int whole = static_cast<int>(wanted + (wanted < 0.0 ? -0.5 : 0.5));
    const double x = (wanted - whole) * kLn2;
    const double rest =
        1.0 +
        x * (1.0 +
             x / 2 *
                 (1.0 +
                  x / 3 * (1.0 + x / 4 * (1.0 + x / 5 * (1.0 + x / 6 * (1.0 + x / 7 * (1.0 + x / 8)))))));
    return rest * std::bit_cast<double>(static_cast<std::uint64_t>(whole + 1023) << 52);
}

double cube_root(double value) {
    if (value == 0.0) return 0.0;
    const double size = value < 0.0 ? -value : value;
    const double root = power(size, 1.0 / 3.0);
    const double mended = root - (root * root * root - size) / (3.0 * root * root);
    return value < 0.0 ? -mended : mended;
}

int solve_quartic(const std::array<double, 5>& c, std::array<double, 4>& roots) {
    double largest = 0.0;
    for (const double value : c) largest = value > largest ? value : (-value > largest ? -value : largest);
    if (!(largest > 0.0 && largest < 1e100)) return 0;
    const auto is_negligible = [&](double value) {
        return value < kNegligible * largest && -value < kNegligible * largest;
    };
    int count = 0;
    if (!is_negligible(c[4])) {
        const double a = c[3] / c[4], b = c[2] / c[4], d = c[1] / c[4], e = c[0] / c[4];
        // t = x - a / 4: x^4 + p x^2 + q x + r.
        const double quarter = a / 4.0, square = quarter * quarter;
        const double p = b - 6.0 * square;
        const double q = d - 2.0 * b * quarter + 8.0 * square * quarter;
        const double r = e - d * quarter + b * square - 3.0 * square * square;
        // (x^2 + m)^2 - (s x - q / 2s)^2 with m = (p + s^2) / 2, s^2 the largest root of the resolvent.
        double resolvent[3];
        solve_cubic(2.0 * p, p * p - 4.0 * r, -q * q, resolvent);
        const double largest_root = resolvent[0];
        if (largest_root > 0.0) {
            const double s = std::sqrt(largest_root);
            const double m = 0.5 * (p + largest_root), n = 0.5 * q / s;
            count = solve_quadratic(1.0, s, m - n, roots.data());
            count += solve_quadratic(1.0, -s, m + n, roots.data() + count);
        } else {
            double squares[2];
            const int found = solve_quadratic(1.0, p, r, squares);
            for (int k = 0; k < found; ++k) {
                if (!(squares[k] >= 0.0)) continue;
                roots[static_cast<std::size_t>(count++)] = std::sqrt(squares[k]);
                roots[static_cast<std::size_t>(count++)] = -std::sqrt(squares[k]);
            }
        }
        for (int k = 0; k < count; ++k) roots[static_cast<std::size_t>(k)] -= quarter;
    } else if (!is_negligible(c[3])) {
        count = solve_cubic(c[2] / c[3], c[1] / c[3], c[0] / c[3], roots.data());
    } else {
        count = solve_quadratic(c[2], c[1], c[0], roots.data());
    }
    for (int k = 0; k < count; ++k)
        roots[static_cast<std::size_t>(k)] = mend(c, roots[static_cast<std::size_t>(k)]);
    return count;
}

}  // namespace batchenc
