#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "kernels/synthetic_clip.h"

namespace batchenc {

// The parts that the sample animations share; synthetic_clip.h is the door.

/// Evenly spread 64-bit number of a key (the finaliser of SplitMix64).
std::uint64_t scramble(std::uint64_t key);

/// Numbers drawn from a seed, one after the other.
class Dice {
 public:
    explicit Dice(std::uint64_t seed) : state_(scramble(seed)) {}
    /// In [low, high).
    double between(double low, double high) {
        state_ += 0x9E3779B97F4A7C15;
        return low + (high - low) * static_cast<double>(scramble(state_) >> 11) * 0x1p-53;
    }
    double phase() { return between(0.0, 6.283185307179586); }

 private:
    std::uint64_t state_;
};

using Vector3 = std::array<float, 3>;

/// x -> rotation x + offset.
struct RigidMotion {
    std::array<std::array<float, 3>, 3> rotation{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    Vector3 offset{0, 0, 0};

    Vector3 turn(const Vector3& x) const {
        Vector3 y;
        for (std::size_t i = 0; i < 3; ++i) {
            y[i] = rotation[i][0] * x[0] + rotation[i][1] * x[1] + rotation[i][2] * x[2];
        }
        return y;
    }
    Vector3 operator()(const Vector3& x) const {
        const Vector3 y = turn(x);
        return {y[0] + offset[0], y[1] + offset[1], y[2] + offset[2]};
    }
    /// First `inner`, then this.
    RigidMotion after(const RigidMotion& inner) const;
};

/// Rotation by an angle (radians, counter-clockwise) about a coordinate axis (0, 1, 2).
RigidMotion rotation_about(std::size_t axis, double angle);

/// Waves over a body's surface, along directions of their own: muscles and wrinkles that an act has.
class Ripples {
 public:
    Ripples() = default;
    /// waves: how many. amplitude: of each at most, metres. finest: of their lengths, metres.
    Ripples(Dice& dice, std::size_t waves, double amplitude, double finest);
    /// How far a point of the body at rest is moved outwards, metres; `now` from at().
    float operator()(const Vector3& rest, std::span<const float> now) const;
    /// What the waves have in common over the body at a time, seconds.
    std::vector<float> at(double time_s) const;

 private:
    struct Wave {
        Vector3 direction;
        float phase;
        double frequency, beat, amplitude;
    };
    std::vector<Wave> waves_;
};

/// A body that can also move in other ways than its own, for as long as an act of a medley lasts.
class Performer : public SyntheticClip {
 public:
    /// Writes the body, 3 × V float32, as it is time_s seconds (any sign) into the act of this seed. It stays
    /// about where it began.
    virtual void write_act(std::uint64_t act_seed, double time_s, std::span<float> positions) const = 0;
};

std::unique_ptr<Performer> make_walker(std::int64_t vertex_count, std::uint64_t seed);
std::unique_ptr<Performer> make_flag(std::int64_t vertex_count, std::uint64_t seed);
std::unique_ptr<Performer> make_jelly(std::int64_t vertex_count, std::uint64_t seed);
std::unique_ptr<SyntheticClip> make_medley(std::int64_t vertex_count, std::uint64_t seed);

}  // namespace batchenc
