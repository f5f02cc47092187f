#include <algorithm>
#include <cmath>

#include "kernels/synthetic_kinds.h"

// A cloth on a pole. Waves of incommensurable frequencies run along it and turn its threads from the wind's
// direction; a row is the integral of its threads' directions from the pole on, so that no thread changes its
// length.

namespace batchenc {
namespace {

constexpr double kWidth = 1.8, kHeight = 1.2;  // metres
constexpr std::size_t kWaves = 8;

struct Wave {
    double along, across;     // radians a metre
    double frequency;         // radians a second
    double phase, amplitude;  // radians
};

struct Size {
    std::int64_t columns, rows;
};

Size choose_size(std::int64_t vertex_count) {
    const double ideal = std::sqrt(static_cast<double>(vertex_count) * kHeight / kWidth);
    Size best{0, 0};
    double best_cost = 1e300;
    for (auto rows = static_cast<std::int64_t>(ideal * 0.8); rows <= static_cast<std::int64_t>(ideal * 1.25);
         ++rows) {
        const std::int64_t columns = (vertex_count + rows / 2) / rows;
        const auto miss = static_cast<double>(std::abs(columns * rows - vertex_count));
        const double cost =
            miss + 0.5 * std::abs(static_cast<double>(rows) / ideal - 1.0);  // shape decides ties
        if (cost < best_cost) {
            best_cost = cost;
            best = {columns, rows};
        }
    }
    return best;
}

struct Wind {
    std::array<Wave, kWaves> waves{};
    std::array<double, 4> slow_phases{};
    double strength = 1.0;  // how far the cloth turns
};

Wind draw_wind(Dice& dice) {
    Wind wind;
    for (std::size_t i = 0; i < kWaves; ++i) {
        const double along = 2.6 * std::pow(1.37, static_cast<double>(i)) * dice.between(0.93, 1.07);
        // Longer waves turn the cloth further, and all travel at about the speed of the wind that carries
        // them.
        wind.waves[i] = {along, along * dice.between(-0.45, 0.45), along * dice.between(1.5, 2.1),
                         dice.phase(), 0.75 / std::pow(along, 0.4) * dice.between(0.7, 1.0)};
    }
    for (double& phase : wind.slow_phases) phase = dice.phase();
    return wind;
}

class Flag final : public Performer {
 public:
    Flag(std::int64_t vertex_count, std::uint64_t seed) {
        Dice dice(seed ^ 0xF1A6);
        const Size size = choose_size(vertex_count);
        columns_ = size.columns;
        rows_ = size.rows;
        wind_ = draw_wind(dice);
        // Lines of the weave at uneven distances, the first one at the pole.
        const auto place = [&dice](std::int64_t i, std::int64_t count, double length) {
            const bool end = i == 0 || i + 1 == count;
            const double jitter = end ? 0.0 : dice.between(-0.2, 0.2);
            return static_cast<float>(length * (static_cast<double>(i) + jitter) /
                                      static_cast<double>(count - 1));
        };
        for (std::int64_t i = 0; i < columns_; ++i) along_.push_back(place(i, columns_, kWidth));
        for (std::int64_t i = 0; i < rows_; ++i) across_.push_back(place(i, rows_, kHeight));

        placement_ = rotation_about(2, dice.phase()).after(rotation_about(0, dice.between(-0.1, 0.1)));
        placement_.offset = {static_cast<float>(dice.between(-1, 1)), static_cast<float>(dice.between(-1, 1)),
                             static_cast<float>(dice.between(1.8, 2.4))};

        for (std::int64_t y = 0; y + 1 < rows_; ++y) {
            for (std::int64_t x = 0; x + 1 < columns_; ++x) {
                const auto a = static_cast<std::int32_t>(y * columns_ + x), b = a + 1;
                const auto d = static_cast<std::int32_t>(a + columns_), c = d + 1;
                triangles_.push_back({a, b, c});
                triangles_.push_back({a, c, d});
            }
        }
    }

    std::int64_t vertex_count() const override { return columns_ * rows_; }
    const std::vector<Triangle>& triangles() const override { return triangles_; }
    double fps() const override { return 30.0; }

    void write_frame(std::int64_t frame, std::span<float> positions) const override {
        wave(wind_, static_cast<double>(frame) / fps(), positions);
    }

    void write_act(std::uint64_t act_seed, double time_s, std::span<float> positions) const override {
        Dice dice(act_seed);
        Wind wind = draw_wind(dice);
        wind.strength = dice.between(0.4, 1.1);
        const double gusty =
            dice.between(0.7, 2.2);  // shorter waves in a stronger wind, and across the cloth
        for (Wave& wave : wind.waves) {
            wave.along *= gusty;
            wave.across = wave.along * dice.between(-2.0, 2.0);
        }
        wave(wind, time_s * dice.between(0.7, 1.3), positions);
    }

 private:
    void wave(const Wind& wind, double t, std::span<float> positions) const {
        const double gust = 0.78 + 0.22 * std::sin(0.431 * t + wind.slow_phases[0]) *
                                       std::sin(1.173 * t + wind.slow_phases[1]);
        const double sag = 0.16 + 0.05 * std::sin(0.297 * t + wind.slow_phases[2]);
        const double lift = 0.05 * std::sin(0.713 * t + wind.slow_phases[3]);

        // sin(a + b) = sin a cos b + cos a sin b parts a wave into a row and a column of numbers.
        const auto columns = static_cast<std::size_t>(columns_);
        std::vector<float> sines(kWaves * columns), cosines(kWaves * columns), sags(columns), turn(columns);
        for (std::size_t x = 0; x < columns; ++x) {
            const double u = along_[x], part = u / kWidth;
            const double envelope = wind.strength * gust * (1.0 - std::exp(-3.0 * part));
            for (std::size_t w = 0; w < kWaves; ++w) {
                const Wave& one = wind.waves[w];
                const double angle = one.along * u - one.frequency * t + one.phase;
                sines[w * columns + x] = static_cast<float>(envelope * one.amplitude * std::sin(angle));
                cosines[w * columns + x] = static_cast<float>(envelope * one.amplitude * std::cos(angle));
            }
            sags[x] = static_cast<float>(sag * part * part - lift * part);
        }
        float* out = positions.data();
        for (std::size_t y = 0; y < static_cast<std::size_t>(rows_); ++y) {
            std::fill(turn.begin(), turn.end(), 0.0f);
            for (std::size_t w = 0; w < kWaves; ++w) {
                const double angle = wind.waves[w].across * across_[y];
                const auto c = static_cast<float>(std::cos(angle)), s = static_cast<float>(std::sin(angle));
                const float* sine = sines.data() + w * columns;
                const float* cosine = cosines.data() + w * columns;
                for (std::size_t x = 0; x < columns; ++x) turn[x] += sine[x] * c + cosine[x] * s;
            }
            float downwind = 0.0f, aside = 0.0f;
            for (std::size_t x = 0; x < columns; ++x) {
                if (x > 0) {
                    const float thread = along_[x] - along_[x - 1];
                    downwind += thread * std::cos(turn[x]);
                    aside += thread * std::sin(turn[x]);
                }
                const Vector3 p = placement_({downwind, aside, across_[y] - sags[x]});
                out = std::copy(p.begin(), p.end(), out);
            }
        }
    }

    std::int64_t columns_ = 0, rows_ = 0;
    Wind wind_;
    std::vector<float> along_, across_;  // metres from the pole, from the lower edge
    RigidMotion placement_;
    std::vector<Triangle> triangles_;
};

}  // namespace

std::unique_ptr<Performer> make_flag(std::int64_t vertex_count, std::uint64_t seed) {
    return std::make_unique<Flag>(vertex_count, seed);
}

}  // namespace batchenc
