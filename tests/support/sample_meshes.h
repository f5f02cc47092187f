#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <map>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "core/mesh_sequence.h"

namespace batchenc::test {

// Meshes of every kind for what codes triangles. They are the same on every machine: the standard fixes what
// std::mt19937 draws, but not what std::shuffle or a distribution makes of it, so these are written out.

/// 0 … count - 1.
inline std::int32_t draw(std::mt19937& generator, std::int64_t count) {
    return static_cast<std::int32_t>(generator() % static_cast<std::uint64_t>(count));
}

template <typename T>
void shuffle(std::vector<T>& items, std::mt19937& generator) {
    for (std::size_t i = items.size(); i > 1; --i)
        std::swap(items[i - 1], items[static_cast<std::size_t>(draw(generator, static_cast<int>(i)))]);
}

/// Gives the vertices below vertex_count other indices below it.
inline void rename_vertices(std::vector<Triangle>& triangles, std::int64_t vertex_count,
                            std::mt19937& generator) {
    std::vector<std::int32_t> name(static_cast<std::size_t>(vertex_count));
    for (std::size_t v = 0; v < name.size(); ++v) name[v] = static_cast<std::int32_t>(v);
    shuffle(name, generator);
    for (Triangle& t : triangles) {
        for (std::int32_t& v : t) v = name[static_cast<std::size_t>(v)];
    }
}

/// Lets every triangle begin at any of its corners.
inline void rotate_corners(std::vector<Triangle>& triangles, std::mt19937& generator) {
    for (Triangle& t : triangles) std::rotate(t.begin(), t.begin() + draw(generator, 3), t.end());
}

/// Each triangle from its smallest corner on, and all of them sorted: what stays when order is free.
inline std::vector<Triangle> without_order(std::vector<Triangle> triangles) {
    for (Triangle& t : triangles) {
        const Triangle second = {t[1], t[2], t[0]}, third = {t[2], t[0], t[1]};
        t = std::min({t, second, third});
    }
    std::sort(triangles.begin(), triangles.end());
    return triangles;
}

/// columns × rows vertices, row by row.
inline std::vector<Triangle> grid(std::int32_t columns, std::int32_t rows) {
    std::vector<Triangle> triangles;
    for (std::int32_t y = 0; y + 1 < rows; ++y) {
        for (std::int32_t x = 0; x + 1 < columns; ++x) {
            const std::int32_t v = columns * y + x;
            triangles.push_back({v, v + 1, v + columns + 1});
            triangles.push_back({v, v + columns + 1, v + columns});
        }
    }
    return triangles;
}

/// A grid whose last column meets the first and whose last row meets the first; `turned` meets them the other
/// way up, which makes a Klein bottle.
inline std::vector<Triangle> torus(std::int32_t columns, std::int32_t rows, bool turned = false) {
    std::vector<Triangle> triangles;
    const auto at = [&](std::int32_t x, std::int32_t y) {
        if (y == rows) {
            y = 0;
            if (turned) x = 2 * columns - x;
        }
        return columns * y + x % columns;
    };
    for (std::int32_t y = 0; y < rows; ++y) {
        for (std::int32_t x = 0; x < columns; ++x) {
            triangles.push_back({at(x, y), at(x + 1, y), at(x + 1, y + 1)});
            triangles.push_back({at(x, y), at(x + 1, y + 1), at(x, y + 1)});
        }
    }
    return triangles;
}

/// A band of 2 × length vertices whose ends meet the other way up.
inline std::vector<Triangle> moebius_strip(std::int32_t length) {
    std::vector<Triangle> triangles;
    const auto at = [&](std::int32_t x, std::int32_t side) {
        return x == length ? 1 - side : 2 * x + side;  // half a turn at the end
    };
    for (std::int32_t x = 0; x < length; ++x) {
        triangles.push_back({at(x, 0), at(x + 1, 0), at(x + 1, 1)});
        triangles.push_back({at(x, 0), at(x + 1, 1), at(x, 1)});
    }
    return triangles;
}

/// Triangles around vertex 0.
inline std::vector<Triangle> fan(std::int32_t size, bool is_open) {
    std::vector<Triangle> triangles;
    for (std::int32_t i = 1; i <= size; ++i) triangles.push_back({0, i, !is_open && i == size ? 1 : i + 1});
    return triangles;
}

/// The same surface with edges turned at random, so that valences vary; no edge gets a third triangle.
inline void turn_edges(std::vector<Triangle>& triangles, int count, std::mt19937& generator) {
    std::map<std::pair<std::int32_t, std::int32_t>, std::size_t> triangle_at;
    const auto note = [&](std::size_t t) {
        for (std::size_t k = 0; k < 3; ++k) triangle_at[{triangles[t][k], triangles[t][(k + 1) % 3]}] = t;
    };
    for (std::size_t t = 0; t < triangles.size(); ++t) note(t);
    for (int i = 0; i < count; ++i) {
        const auto t = static_cast<std::size_t>(draw(generator, static_cast<int>(triangles.size())));
        const auto k = static_cast<std::size_t>(draw(generator, 3));
        const std::int32_t a = triangles[t][k], b = triangles[t][(k + 1) % 3], c = triangles[t][(k + 2) % 3];
        const auto across = triangle_at.find({b, a});
        if (across == triangle_at.end()) continue;
        const std::size_t other = across->second;
        std::int32_t d = -1;
        for (const std::int32_t v : triangles[other]) {
            if (v != a && v != b) d = v;
        }
        if (c == d || triangle_at.contains({c, d}) || triangle_at.contains({d, c})) continue;
        triangle_at.erase({a, b});
        triangle_at.erase({b, a});
        triangles[t] = {c, a, d};
        triangles[other] = {d, b, c};
        note(t);
        note(other);
    }
}

/// The faces between filled and empty cells of a cube, each cell filled with a probability of `eighths`:
/// closed, with many handles, edges of four triangles, and vertices where pieces only touch.
inline std::vector<Triangle> random_cells(std::int32_t side, int eighths, std::mt19937& generator) {
    std::vector<std::uint8_t> is_filled(static_cast<std::size_t>(side * side * side));
    for (auto& cell : is_filled) cell = draw(generator, 8) < eighths ? 1 : 0;
    const auto filled = [&](std::array<std::int32_t, 3> c) {
        for (const std::int32_t x : c) {
            if (x < 0 || x >= side) return false;
        }
        return is_filled[static_cast<std::size_t>((c[2] * side + c[1]) * side + c[0])] != 0;
    };
    std::vector<Triangle> triangles;
    for (std::int32_t z = 0; z < side; ++z) {
        for (std::int32_t y = 0; y < side; ++y) {
            for (std::int32_t x = 0; x < side; ++x) {
                if (!filled({x, y, z})) continue;
                for (std::size_t axis = 0; axis < 3; ++axis) {
                    for (const std::int32_t up : {0, 1}) {
                        std::array<std::int32_t, 3> across = {x, y, z};
                        across[axis] += up == 1 ? 1 : -1;
                        if (filled(across)) continue;
                        const auto corner = [&](std::int32_t i, std::int32_t j) {
                            std::array<std::int32_t, 3> p = {x, y, z};
                            p[axis] += up;
                            p[(axis + 1) % 3] += i;
                            p[(axis + 2) % 3] += j;
                            return (p[2] * (side + 1) + p[1]) * (side + 1) + p[0];
                        };
                        const std::int32_t a = corner(0, 0), b = corner(1, 0), c = corner(1, 1),
                                           d = corner(0, 1);
                        if (up == 1) {
                            triangles.push_back({a, b, c});
                            triangles.push_back({a, c, d});
                        } else {
                            triangles.push_back({a, c, b});
                            triangles.push_back({a, d, c});
                        }
                    }
                }
            }
        }
    }
    return triangles;
}

inline std::vector<Triangle> random_triangles(std::int32_t count, std::int32_t vertex_count,
                                              std::mt19937& generator) {
    std::vector<Triangle> triangles(static_cast<std::size_t>(count));
    for (Triangle& t : triangles) {
        for (std::int32_t& v : t) v = draw(generator, vertex_count);
    }
    return triangles;
}

struct NamedMesh {
    std::string name;
    std::int64_t vertex_count;
    std::vector<Triangle> triangles;
};

inline std::vector<NamedMesh> every_kind_of_mesh() {
    constexpr std::int32_t kLast = std::numeric_limits<std::int32_t>::max() - 1;
    std::mt19937 generator(20);
    std::vector<NamedMesh> meshes = {
        {"nothing", 0, {}},
        {"points", 5, {}},
        {"one triangle", 3, {{2, 0, 1}}},
        {"two triangles", 4, {{0, 1, 2}, {2, 1, 3}}},
        {"tetrahedron", 4, {{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}}},
        {"two triangles back to back", 3, {{0, 1, 2}, {2, 1, 0}}},
        {"isolated triangles", 12, {{9, 10, 11}, {0, 1, 2}, {6, 7, 8}, {3, 5, 4}}},
        {"grid", 13 * 10, grid(13, 10)},
        {"row", 2 * 40, grid(40, 2)},
        {"torus", 12 * 9, torus(12, 9)},
        {"smallest torus", 9, torus(3, 3)},
        {"Klein bottle", 8 * 7, torus(8, 7, true)},
        {"Moebius strip", 2 * 9, moebius_strip(9)},
        {"projective plane",
         6,
         {{0, 1, 2},
          {0, 2, 3},
          {0, 3, 4},
          {0, 4, 5},
          {0, 5, 1},
          {1, 2, 4},
          {2, 3, 5},
          {3, 4, 1},
          {4, 5, 2},
          {5, 1, 3}}},
        {"open hub", 5002, fan(5000, true)},
        {"closed hub", 5001, fan(5000, false)},
        {"edge of three", 5, {{0, 1, 2}, {1, 0, 3}, {0, 1, 4}}},
        {"edge of many", 6, {{0, 1, 2}, {1, 0, 3}, {0, 1, 4}, {1, 0, 5}, {0, 1, 5}, {0, 1, 2}, {1, 0, 4}}},
        {"bow tie", 5, {{0, 1, 2}, {2, 3, 4}}},
        {"touching corners", 7, {{0, 1, 2}, {0, 3, 4}, {0, 5, 6}, {1, 3, 5}}},
        {"inconsistent winding", 4, {{0, 1, 2}, {1, 2, 3}, {3, 2, 1}}},
        {"degenerate", 3, {{0, 0, 1}, {1, 1, 1}, {2, 0, 2}, {0, 1, 2}, {1, 2, 2}}},
        {"repeated", 3, {{0, 1, 2}, {0, 1, 2}, {1, 2, 0}, {0, 1, 2}, {2, 1, 0}}},
        {"unused vertices", 1000000, {{999999, 5, 70000}, {5, 999999, 100}}},
        {"largest indices",
         std::int64_t{kLast} + 1,
         {{0, kLast, 0},
          {kLast, 0, kLast - 1},
          {kLast, kLast - 1, 7},
          {0, 1, 2},
          {kLast, kLast, kLast},
          {kLast - 1, kLast, 5}}},
    };
    const auto add = [&](const char* name, std::int64_t vertex_count, std::vector<Triangle> triangles) {
        meshes.push_back({name, vertex_count, std::move(triangles)});
    };

    auto mesh = grid(13, 10);
    for (Triangle& t : mesh) {
        if (draw(generator, 2) == 1) std::swap(t[0], t[1]);
    }
    add("grid wound at random", 13 * 10, mesh);
    mesh = grid(20, 20);
    shuffle(mesh, generator);
    mesh.resize(mesh.size() * 7 / 8);
    add("grid with holes", 20 * 20, mesh);
    mesh.resize(mesh.size() / 3);
    add("scraps of a grid", 20 * 20, mesh);
    mesh = torus(20, 15);
    turn_edges(mesh, 2000, generator);
    add("irregular torus", 20 * 15, mesh);
    mesh.erase(mesh.begin() + 100, mesh.begin() + 140);
    mesh.push_back(mesh[0]);
    mesh.push_back({5, 5, 9});
    mesh.push_back({mesh[7][0], mesh[7][1], 200});
    add("irregular, damaged", 20 * 15, mesh);
    add("half-filled cells", 7 * 7 * 7, random_cells(6, 4, generator));
    add("mostly filled cells", 9 * 9 * 9, random_cells(8, 7, generator));
    for (const std::int32_t vertex_count : {1, 2, 3, 4, 5, 8, 20, 100, 1000, 100000}) {
        for (const std::int32_t count : {2, 10, 3000}) {
            meshes.push_back(
                {std::to_string(count) + " random triangles on " + std::to_string(vertex_count) + " vertices",
                 vertex_count, random_triangles(count, vertex_count, generator)});
        }
    }
    return meshes;
}

/// The same mesh with triangles, corners and indices in any order.
inline NamedMesh shuffled(NamedMesh mesh, std::mt19937& generator) {
    shuffle(mesh.triangles, generator);
    rotate_corners(mesh.triangles, generator);
    if (mesh.vertex_count <= 1000000) rename_vertices(mesh.triangles, mesh.vertex_count, generator);
    mesh.name += ", shuffled";
    return mesh;
}

}  // namespace batchenc::test
