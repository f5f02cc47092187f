#include "kernels/synthetic_clip.h"

#include <cmath>
#include <new>
#include <string>

#include "kernels/synthetic_kinds.h"

namespace batchenc {
namespace {

constexpr std::int64_t kMostVertices = 1000000;

struct Kind {
    std::string_view name;
    std::int64_t fewest_vertices;
    std::unique_ptr<SyntheticClip> (*make)(std::int64_t vertex_count, std::uint64_t seed);
};

template <auto make>
std::unique_ptr<SyntheticClip> make_kind(std::int64_t vertex_count, std::uint64_t seed) {
    return make(vertex_count, seed);
}

constexpr std::array<Kind, 4> kKinds = {Kind{"walker", 64, &make_kind<&make_walker>},
                                        {"flag", 64, &make_kind<&make_flag>},
                                        {"jelly", 64, &make_kind<&make_jelly>},
                                        {"medley", 256, &make_kind<&make_medley>}};

}  // namespace

std::uint64_t scramble(std::uint64_t key) {
    key = (key ^ (key >> 30)) * 0xBF58476D1CE4E5B9;
    key = (key ^ (key >> 27)) * 0x94D049BB133111EB;
    return key ^ (key >> 31);
}

RigidMotion RigidMotion::after(const RigidMotion& inner) const {
    RigidMotion both;
    for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t j = 0; j < 3; ++j) {
            both.rotation[i][j] = rotation[i][0] * inner.rotation[0][j] +
                                  rotation[i][1] * inner.rotation[1][j] +
                                  rotation[i][2] * inner.rotation[2][j];
        }
    }
    both.offset = (*this)(inner.offset);
    return both;
}

RigidMotion rotation_about(std::size_t axis, double angle) {
    const auto c = static_cast<float>(std::cos(angle)), s = static_cast<float>(std::sin(angle));
    const std::size_t from = (axis + 1) % 3, to = (axis + 2) % 3;
    RigidMotion motion;
    motion.rotation[from][from] = motion.rotation[to][to] = c;
    motion.rotation[to][from] = s;
    motion.rotation[from][to] = -s;
    return motion;
}

Ripples::Ripples(Dice& dice, std::size_t waves, double amplitude, double finest) {
    for (std::size_t i = 0; i < waves; ++i) {
        Wave& wave = waves_.emplace_back();
        double length = 0.0;
        std::array<double, 3> direction{};
        for (double& d : direction) {
            d = dice.between(-1.0, 1.0);
            length += d * d;
        }
        const double stretch =
            2.0 * 3.141592653589793 / (finest * dice.between(1.0, 2.0) * std::sqrt(length + 1e-9));
        for (std::size_t axis = 0; axis < 3; ++axis)
            wave.direction[axis] = static_cast<float>(stretch * direction[axis]);
        wave.phase = static_cast<float>(dice.phase());
        wave.frequency = dice.between(3.0, 9.0);
        wave.beat = dice.phase();
        wave.amplitude = amplitude * dice.between(0.4, 1.0);
    }
}

std::vector<float> Ripples::at(double time_s) const {
    std::vector<float> now;
    for (const Wave& wave : waves_)
        now.push_back(static_cast<float>(wave.amplitude * std::sin(wave.frequency * time_s + wave.beat)));
    return now;
}

float Ripples::operator()(const Vector3& rest, std::span<const float> now) const {
    float sum = 0.0f;
    for (std::size_t i = 0; i < waves_.size(); ++i) {
        const Vector3& k = waves_[i].direction;
        sum += now[i] * std::sin(k[0] * rest[0] + k[1] * rest[1] + k[2] * rest[2] + waves_[i].phase);
    }
    return sum;
}

Expected<std::unique_ptr<SyntheticClip>> make_synthetic_clip(std::string_view kind, std::int64_t vertex_count,
                                                             std::uint64_t seed) {
    std::string names;
    for (const Kind& known : kKinds) {
        names += (names.empty() ? "" : ", ") + std::string(known.name);
        if (kind != known.name) continue;
        if (vertex_count < known.fewest_vertices || vertex_count > kMostVertices) {
            return fail(ErrorCode::kInvalidArgument,
                        std::to_string(vertex_count) + " vertices; such a sample clip has " +
                            std::to_string(known.fewest_vertices) + " to " + std::to_string(kMostVertices));
        }
        try {
            return known.make(vertex_count, seed);
        } catch (const std::bad_alloc&) {
            return fail(ErrorCode::kOutOfMemory,
                        "no memory for " + std::to_string(vertex_count) + " vertices");
        }
    }
    return fail(ErrorCode::kInvalidArgument,
                "no sample clip is called \"" + std::string(kind) + "\"; there are " + names);
}

}  // namespace batchenc
