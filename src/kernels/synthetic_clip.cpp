#include "kernels/synthetic_clip.h"

#include <cmath>
#include <new>
#include <string>

#include "kernels/synthetic_kinds.h"

namespace batchenc {
namespace {

constexpr std::int64_t kFewestVertices = 64;
constexpr std::int64_t kMostVertices = 1000000;

struct Kind {
    std::string_view name;
    std::unique_ptr<SyntheticClip> (*make)(std::int64_t vertex_count, std::uint64_t seed);
};
constexpr std::array<Kind, 3> kKinds = {
    Kind{"walker", &make_walker}, {"flag", &make_flag}, {"jelly", &make_jelly}};

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

Expected<std::unique_ptr<SyntheticClip>> make_synthetic_clip(std::string_view kind, std::int64_t vertex_count,
                                                             std::uint64_t seed) {
    if (vertex_count < kFewestVertices || vertex_count > kMostVertices) {
        return fail(ErrorCode::kInvalidArgument,
                    std::to_string(vertex_count) + " vertices; a sample clip has " +
                        std::to_string(kFewestVertices) + " to " + std::to_string(kMostVertices));
    }
    std::string names;
    for (const Kind& known : kKinds) {
        try {
            if (kind == known.name) return known.make(vertex_count, seed);
        } catch (const std::bad_alloc&) {
            return fail(ErrorCode::kOutOfMemory,
                        "no memory for " + std::to_string(vertex_count) + " vertices");
        }
        names += (names.empty() ? "" : ", ") + std::string(known.name);
    }
    return fail(ErrorCode::kInvalidArgument,
                "no sample clip is called \"" + std::string(kind) + "\"; there are " + names);
}

}  // namespace batchenc
