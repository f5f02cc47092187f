#include <algorithm>
#include <cmath>

#include "kernels/synthetic_kinds.h"

// A lump of jelly. Its centre flies parabolas between bounces of falling speed, then is tossed up anew; each
// bounce squashes it and rings its modes, which decay. The surface is that of a box blown up to a sphere:
// even triangles and nearly any number of vertices.

namespace batchenc {
namespace {

constexpr double kGravity = 9.81;      // m/s^2
constexpr double kRadius = 0.5;        // metres
constexpr double kFirstSpeed = 4.9;    // m/s, of the toss
constexpr double kRestitution = 0.78;  // speed kept in a bounce
constexpr std::int64_t kFlights = 6;   // from a toss to the next
constexpr std::size_t kModes = 10;
constexpr int kRemembered = 10;  // bounces whose ringing is still felt

struct Size {
    std::int64_t a, b, c;  // cells along each side of the box
    std::int64_t vertex_count() const { return 2 * (a * b + b * c + c * a) + 2; }
};

Size choose_size(std::int64_t vertex_count) {
    const auto n = static_cast<std::int64_t>(std::sqrt(static_cast<double>(vertex_count) / 6.0));
    const std::int64_t low = std::max<std::int64_t>(1, n - 3), high = n + 4;
    Size best{};
    double best_cost = 1e300;
    for (std::int64_t a = low; a <= high; ++a) {
        for (std::int64_t b = a; b <= high; ++b) {
            for (std::int64_t c = b; c <= high; ++c) {
                const Size size{a, b, c};
                const auto miss = static_cast<double>(std::abs(size.vertex_count() - vertex_count));
                const double cost =
                    miss + 0.1 * static_cast<double>(c) / static_cast<double>(a);  // evenness decides ties
                if (cost < best_cost) {
                    best_cost = cost;
                    best = size;
                }
            }
        }
    }
    return best;
}

// Vertices on the surface of the box, layer by layer: a whole grid below and above, rings between.
class BoxSurface {
 public:
    explicit BoxSurface(const Size& size) : size_(size) {}

    std::int32_t index(std::int64_t i, std::int64_t j, std::int64_t k) const {
        const std::int64_t grid = (size_.a + 1) * (size_.b + 1), ring = ring_length();
        if (k == 0) return static_cast<std::int32_t>(j * (size_.a + 1) + i);
        if (k == size_.c) return static_cast<std::int32_t>(grid + (k - 1) * ring + j * (size_.a + 1) + i);
        const std::int64_t around = j == 0         ? i
                                    : i == size_.a ? size_.a + j
                                    : j == size_.b ? 2 * size_.a + size_.b - i
                                                   : 2 * (size_.a + size_.b) - j;
        return static_cast<std::int32_t>(grid + (k - 1) * ring + around);
    }
    std::int64_t ring_length() const { return 2 * (size_.a + size_.b); }
    // Grid coordinates of a place on the ring, counter-clockwise seen from above.
    std::pair<std::int64_t, std::int64_t> on_ring(std::int64_t around) const {
        if (around < size_.a) return {around, 0};
        if (around < size_.a + size_.b) return {size_.a, around - size_.a};
        if (around < 2 * size_.a + size_.b) return {2 * size_.a + size_.b - around, size_.b};
        return {0, 2 * (size_.a + size_.b) - around};
    }

 private:
    Size size_;
};

// How the body rings after a bounce, and where it goes.
struct Excitation {
    std::uint64_t seed = 0;  // of bounces and places
    std::array<double, kModes> frequency{}, decay{}, amplitude{};
    std::array<double, 3> spin_phases{};
    double reach = 1.0;  // how far tosses go
    Ripples ripples;
};

Excitation draw_excitation(std::uint64_t seed, Dice& dice) {
    Excitation excitation;
    excitation.seed = seed;
    for (std::size_t m = 0; m < kModes; ++m) {
        excitation.frequency[m] = 11.0 * std::pow(1.21, static_cast<double>(m)) * dice.between(0.95, 1.05);
        excitation.decay[m] = excitation.frequency[m] * dice.between(0.12, 0.18);
        excitation.amplitude[m] = 0.16 / (1.0 + 0.35 * static_cast<double>(m)) * dice.between(0.7, 1.0);
    }
    for (double& phase : excitation.spin_phases) phase = dice.phase();
    return excitation;
}

class Jelly final : public Performer {
 public:
    Jelly(std::int64_t vertex_count, std::uint64_t seed) {
        const std::uint64_t own = scramble(seed ^ 0x1E117);
        Dice dice(own);
        const Size size = choose_size(vertex_count);
        excitation_ = draw_excitation(own, dice);
        make_vertices(size, dice);
        make_triangles(size);
        for (std::int64_t i = 0; i < kFlights; ++i) period_ += flight_time(i);
    }

    std::int64_t vertex_count() const override { return static_cast<std::int64_t>(rest_.size()); }
    const std::vector<Triangle>& triangles() const override { return triangles_; }
    double fps() const override { return 60.0; }

    void write_frame(std::int64_t frame, std::span<float> positions) const override {
        bounce_about(excitation_, static_cast<double>(frame) / fps(), positions);
    }

    void write_act(std::uint64_t act_seed, double time_s, std::span<float> positions) const override {
        Dice dice(act_seed);
        Excitation excitation = draw_excitation(act_seed, dice);
        const double strength = dice.between(0.3, 1.0);
        for (double& amplitude : excitation.amplitude) amplitude *= strength;
        excitation.reach = dice.between(0.1, 0.3);
        excitation.ripples = Ripples(dice, 12, 0.02, 0.12);
        bounce_about(excitation, time_s, positions);
    }

 private:
    void bounce_about(const Excitation& excitation, double t, std::span<float> positions) const {
        const auto toss = static_cast<std::int64_t>(t / period_);
        double since = t - static_cast<double>(toss) * period_;  // seconds since the flight began
        std::int64_t flight = 0;
        while (flight + 1 < kFlights && since >= flight_time(flight)) since -= flight_time(flight++);
        const double height = std::max(0.0, speed(flight) * since - 0.5 * kGravity * since * since);

        double squash = 0.0;
        std::array<float, kModes> bend{};
        std::int64_t bounce = toss * kFlights + flight;
        for (int i = 0; i < kRemembered && bounce >= 0; ++i, --bounce) {
            const double strength = speed(bounce % kFlights) / kFirstSpeed;
            squash -= 0.3 * strength * std::exp(-2.6 * since) * std::sin(13.0 * since);
            Dice dice(excitation.seed + static_cast<std::uint64_t>(bounce));
            for (std::size_t m = 0; m < kModes; ++m) {
                bend[m] += static_cast<float>(dice.between(-1.0, 1.0) * excitation.amplitude[m] * strength *
                                              std::exp(-excitation.decay[m] * since) *
                                              std::sin(excitation.frequency[m] * since));
            }
            since += flight_time((bounce + kFlights - 1) % kFlights);
        }

        const auto stretch = static_cast<float>(1.0 + squash);
        const float widen = 1.0f / std::sqrt(stretch);  // the volume stays
        const RigidMotion spin =
            rotation_about(2, 0.61 * t + 0.8 * std::sin(0.373 * t + excitation.spin_phases[0]))
                .after(rotation_about(0, 0.9 * std::sin(0.517 * t + excitation.spin_phases[1])))
                .after(rotation_about(1, 0.7 * std::sin(0.811 * t + excitation.spin_phases[2])));
        const double part = t / period_ - static_cast<double>(toss);
        const auto here = landing(excitation, toss), there = landing(excitation, toss + 1);
        const Vector3 centre = {static_cast<float>(here[0] + part * (there[0] - here[0])),
                                static_cast<float>(here[1] + part * (there[1] - here[1])),
                                static_cast<float>(height + kRadius * (1.0 + squash))};
        const auto ripples = excitation.ripples.at(t);
        float* out = positions.data();
        for (std::size_t v = 0; v < rest_.size(); ++v) {
            float swell = 1.0f + excitation.ripples(rest_[v], ripples);
            for (std::size_t m = 0; m < kModes; ++m) swell += bend[m] * modes_[v][m];
            const Vector3 p = spin.turn(rest_[v]);
            *out++ = p[0] * swell * widen + centre[0];
            *out++ = p[1] * swell * widen + centre[1];
            *out++ = p[2] * swell * stretch + centre[2];
        }
    }

    static double speed(std::int64_t flight) {
        return kFirstSpeed * std::pow(kRestitution, static_cast<double>(flight));
    }
    static double flight_time(std::int64_t flight) { return 2.0 * speed(flight) / kGravity; }
    // Where a toss begins, metres.
    static std::array<double, 2> landing(const Excitation& excitation, std::int64_t toss) {
        Dice dice(scramble(excitation.seed + 77) + static_cast<std::uint64_t>(toss));
        const double x = dice.between(-2.0, 2.0), y = dice.between(-2.0, 2.0);
        return {excitation.reach * x, excitation.reach * y};
    }

    void make_vertices(const Size& size, Dice& dice) {
        std::array<std::array<double, 4>, 3> ripples{};  // directions and phases of the shortest modes
        for (auto& ripple : ripples)
            ripple = {dice.between(-5, 5), dice.between(-5, 5), dice.between(-5, 5), dice.phase()};
        std::array<double, 4> bumps{};
        for (double& bump : bumps) bump = dice.between(-0.12, 0.12);

        const auto add = [&](std::int64_t i, std::int64_t j, std::int64_t k) {
            // The tangent evens out what the projection to the sphere would crowd at the edges of the box.
            const auto coordinate = [&](std::int64_t at, std::int64_t cells) {
                const double jitter = at == 0 || at == cells ? 0.0 : dice.between(-0.15, 0.15);
                return std::tan(
                    0.7853981633974483 *
                    (2.0 * (static_cast<double>(at) + jitter) / static_cast<double>(cells) - 1.0));
            };
            double x = coordinate(i, size.a), y = coordinate(j, size.b), z = coordinate(k, size.c);
            const double length = std::sqrt(x * x + y * y + z * z);
            x /= length, y /= length, z /= length;
            const double radius = kRadius * (1.0 + bumps[0] * x * y + bumps[1] * z +
                                             bumps[2] * (y * y - z * z) + bumps[3] * x * x * x);
            rest_.push_back({static_cast<float>(radius * x), static_cast<float>(radius * y),
                             static_cast<float>(radius * z)});
            std::array<double, kModes> mode = {
                x * x - y * y,   2.0 * x * y,        2.0 * y * z, 2.0 * z * x, x * (x * x - 3.0 * y * y),
                3.0 * x * y * z, z * (x * x - y * y)};
            for (std::size_t r = 0; r < ripples.size(); ++r) {
                const auto& [kx, ky, kz, phase] = ripples[r];
                mode[kModes - ripples.size() + r] = 0.6 * std::sin(kx * x + ky * y + kz * z + phase);
            }
            auto& stored = modes_.emplace_back();
            for (std::size_t m = 0; m < kModes; ++m) stored[m] = static_cast<float>(mode[m]);
        };
        const BoxSurface box(size);
        for (std::int64_t k = 0; k <= size.c; ++k) {
            if (k == 0 || k == size.c) {
                for (std::int64_t j = 0; j <= size.b; ++j) {
                    for (std::int64_t i = 0; i <= size.a; ++i) add(i, j, k);
                }
            } else {
                for (std::int64_t around = 0; around < box.ring_length(); ++around) {
                    const auto [i, j] = box.on_ring(around);
                    add(i, j, k);
                }
            }
        }
    }

    void make_triangles(const Size& size) {
        const BoxSurface box(size);
        const auto quad = [this](std::int32_t a, std::int32_t b, std::int32_t c, std::int32_t d) {
            triangles_.push_back({a, b, c});
            triangles_.push_back({a, c, d});
        };
        for (std::int64_t j = 0; j < size.b; ++j) {
            for (std::int64_t i = 0; i < size.a; ++i) {
                quad(box.index(i, j, 0), box.index(i, j + 1, 0), box.index(i + 1, j + 1, 0),
                     box.index(i + 1, j, 0));
            }
        }
        for (std::int64_t k = 0; k < size.c; ++k) {
            for (std::int64_t around = 0; around < box.ring_length(); ++around) {
                const auto [i, j] = box.on_ring(around);
                const auto [i2, j2] = box.on_ring((around + 1) % box.ring_length());
                quad(box.index(i, j, k), box.index(i2, j2, k), box.index(i2, j2, k + 1),
                     box.index(i, j, k + 1));
            }
        }
        for (std::int64_t j = 0; j < size.b; ++j) {
            for (std::int64_t i = 0; i < size.a; ++i) {
                quad(box.index(i, j, size.c), box.index(i + 1, j, size.c), box.index(i + 1, j + 1, size.c),
                     box.index(i, j + 1, size.c));
            }
        }
    }

    Excitation excitation_;
    double period_ = 0.0;  // seconds from a toss to the next
    std::vector<Vector3> rest_;
    std::vector<std::array<float, kModes>> modes_;  // how far each mode swells the body at a vertex
    std::vector<Triangle> triangles_;
};

}  // namespace

std::unique_ptr<Performer> make_jelly(std::int64_t vertex_count, std::uint64_t seed) {
    return std::make_unique<Jelly>(vertex_count, seed);
}

}  // namespace batchenc
