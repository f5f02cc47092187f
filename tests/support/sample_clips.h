#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "core/mesh_sequence.h"

namespace batchenc::test {

/// A clip from a rest shape and a motion: position(vertex's rest position, time in [0, 1]).
using Motion = std::function<std::array<double, 3>(const std::array<double, 3>&, double)>;

inline MeshSequence animate(const std::vector<std::array<double, 3>>& rest, std::vector<Triangle> triangles,
                            std::int64_t frames, const Motion& motion) {
    MeshSequence clip;
    clip.frame_count = frames;
    clip.vertex_count = static_cast<std::int64_t>(rest.size());
    clip.triangles = std::move(triangles);
    for (std::int64_t f = 0; f < frames; ++f) {
        const double time = frames > 1 ? static_cast<double>(f) / static_cast<double>(frames - 1) : 0.0;
        for (const auto& p : rest) {
            for (const double value : motion(p, time)) clip.positions.push_back(static_cast<float>(value));
        }
    }
    return clip;
}

/// Bends and turns and walks: smooth, not rigid, different everywhere.
inline std::array<double, 3> bend(const std::array<double, 3>& p, double time) {
    const double angle = 1.5 * time * p[0] + 2.0 * time;
    const double c = std::cos(angle), s = std::sin(angle);
    return {c * p[0] - s * p[1] + 3.0 * time, s * p[0] + c * p[1],
            p[2] + 0.2 * std::sin(5.0 * time + 2.0 * p[0])};
}

/// A sheet of nx × ny vertices with a boundary.
inline MeshSequence sheet(std::int64_t nx, std::int64_t ny, std::int64_t frames,
                          const Motion& motion = bend) {
    std::vector<std::array<double, 3>> rest;
    std::vector<Triangle> triangles;
    for (std::int64_t y = 0; y < ny; ++y) {
        for (std::int64_t x = 0; x < nx; ++x) {
            const double u = static_cast<double>(x) / static_cast<double>(nx),
                         v = static_cast<double>(y) / static_cast<double>(ny);
            rest.push_back({u, v, 0.1 * std::sin(7.0 * u) * std::cos(5.0 * v)});
            if (x + 1 == nx || y + 1 == ny) continue;
            const auto a = static_cast<std::int32_t>(y * nx + x), b = a + 1,
                       c = static_cast<std::int32_t>(a + nx), d = c + 1;
            triangles.push_back({a, b, d});
            triangles.push_back({a, d, c});
        }
    }
    return animate(rest, std::move(triangles), frames, motion);
}

struct NamedClip {
    std::string name;
    MeshSequence clip;
};

/// Every kind of clip that a coder must take: what people have, and what they have by accident.
inline std::vector<NamedClip> every_kind_of_clip() {
    std::vector<NamedClip> clips;
    const auto add = [&](const char* name, MeshSequence clip) { clips.push_back({name, std::move(clip)}); };
    add("sheet", sheet(12, 10, 17));
    add("one frame", sheet(9, 7, 1));
    add("two frames", sheet(5, 5, 2));
    add("many frames, few vertices", sheet(3, 2, 90));
    add("does not move", sheet(8, 8, 12, [](const std::array<double, 3>& p, double) { return p; }));
    add("moves as one body", sheet(8, 8, 12, [](const std::array<double, 3>& p, double time) {
            return std::array<double, 3>{p[0] + 5.0 * time, p[1], p[2] - time};
        }));
    add("far from the origin", sheet(8, 8, 12, [](const std::array<double, 3>& p, double time) {
            const auto q = bend(p, time);
            return std::array<double, 3>{q[0] + 20000.0, q[1] - 5000.0, q[2]};
        }));
    add("everything in one place", sheet(4, 4, 6, [](const std::array<double, 3>&, double) {
            return std::array<double, 3>{1, 2, 3};
        }));

    MeshSequence points = sheet(10, 9, 11);
    points.triangles.clear();
    add("points", points);

    MeshSequence parts = sheet(6, 6, 10);
    std::erase_if(parts.triangles, [](const Triangle& t) { return t[0] / 6 == 2; });  // a strip is cut out
    add("two components and unused edges", parts);

    MeshSequence odd = sheet(7, 6, 13);
    odd.triangles.push_back(odd.triangles[3]);            // repeated
    odd.triangles.push_back({5, 5, 9});                   // degenerate
    odd.triangles.push_back({0, 1, 20});                  // a third triangle at an edge
    std::swap(odd.triangles[8][1], odd.triangles[8][2]);  // wound the other way
    add("non-manifold, degenerate, repeated", odd);

    MeshSequence unused = sheet(6, 6, 9);
    std::erase_if(unused.triangles, [](const Triangle& t) { return t[0] > 12 || t[1] > 12 || t[2] > 12; });
    add("unused vertices", unused);

    MeshSequence collapsing = sheet(7, 7, 9, [](const std::array<double, 3>& p, double time) {
        const auto q = bend(p, time);
        return time > 0.4 && time < 0.6 ? std::array<double, 3>{q[0], 0.0, 0.0}
                                        : q;  // falls onto a line in between
    });
    add("every triangle collapses", collapsing);

    const auto first_vertices = [](std::int64_t count, std::vector<Triangle> triangles, std::int64_t frames) {
        MeshSequence clip = sheet(count, 1, frames);
        clip.triangles = std::move(triangles);
        return clip;
    };
    add("one triangle", animate({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}, 8, bend));
    add("one vertex", first_vertices(1, {}, 5));
    add("two vertices", first_vertices(2, {}, 5));
    add("four vertices, one triangle",
        animate({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{2, 1, 3}}, 8, bend));
    add("one vertex, one frame", first_vertices(1, {}, 1));
    return clips;
}

/// Largest distance between two clips of the same shape.
inline double largest_distance(PositionsView a, PositionsView b) {
    double largest = 0.0;
    for (std::int64_t k = 0; k < a.frame_count() * a.vertex_count(); ++k) {
        double sum = 0.0;
        for (int c = 0; c < 3; ++c) {
            const double d = static_cast<double>(a.data()[3 * k + c]) - b.data()[3 * k + c];
            sum += d * d;
        }
        largest = std::max(largest, std::sqrt(sum));
    }
    return largest;
}

}  // namespace batchenc::test
