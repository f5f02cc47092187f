#include "kernels/seed_triangles.h"

#include <algorithm>
#include <limits>
#include <numeric>

namespace batchenc {
namespace {

double squared_doubled_area(PositionsView positions, std::int64_t frame, const Triangle& t) {
    const float* p = positions.at(frame, t[0]);
    const float* q = positions.at(frame, t[1]);
    const float* r = positions.at(frame, t[2]);
    const double u[3] = {static_cast<double>(q[0]) - p[0], static_cast<double>(q[1]) - p[1],
                         static_cast<double>(q[2]) - p[2]};
    const double v[3] = {static_cast<double>(r[0]) - p[0], static_cast<double>(r[1]) - p[1],
                         static_cast<double>(r[2]) - p[2]};
    const double x = u[1] * v[2] - u[2] * v[1];
    const double y = u[2] * v[0] - u[0] * v[2];
    const double z = u[0] * v[1] - u[1] * v[0];
    return x * x + y * y + z * z;
}

/// Smallest squared doubled area over time; stops early once it falls to `enough` or below.
double smallest_area(PositionsView positions, const Triangle& t, double enough) {
    double smallest = std::numeric_limits<double>::infinity();
    for (std::int64_t f = 0; f < positions.frame_count() && smallest > enough; ++f) {
        smallest = std::min(smallest, squared_doubled_area(positions, f, t));
    }
    return smallest;
}

struct Candidate {
    Triangle triangle{};
    double area = -1.0;
};

void consider(Candidate& best, PositionsView positions, const Triangle& t) {
    const double area = smallest_area(positions, t, best.area);
    if (area > best.area) best = {t, area};
}

/// Candidate triangles of a seed in a cloud of points: all pairs of its 16 nearest neighbours.
Candidate best_of_points(PositionsView positions, std::int32_t seed) {
    const std::int64_t vertex_count = positions.vertex_count();
    std::vector<std::int32_t> others(static_cast<std::size_t>(vertex_count));
    std::iota(others.begin(), others.end(), 0);
    std::erase(others, seed);
    const auto nearer = [&](std::int32_t a, std::int32_t b) {
        const double da = squared_distance(positions.at(0, a), positions.at(0, seed));
        const double db = squared_distance(positions.at(0, b), positions.at(0, seed));
        return da != db ? da < db : a < b;
    };
    const std::size_t count = std::min<std::size_t>(16, others.size());
    std::partial_sort(others.begin(), others.begin() + static_cast<std::ptrdiff_t>(count), others.end(),
                      nearer);
    Candidate best;
    best.triangle = {seed, others.empty() ? seed : others.front(), seed};
    for (std::size_t i = 0; i < count; ++i) {
        for (std::size_t j = i + 1; j < count; ++j) consider(best, positions, {seed, others[i], others[j]});
    }
    return best;
}

/// The triangles that stay usable in every frame. Over all of them and all frames, so it is done once and
/// with every thread.
std::vector<Triangle> usable_triangles(PositionsView positions, std::span<const Triangle> triangles,
                                       double usable, const Executor& executor) {
    constexpr std::int64_t kBlock = 1024;
    const auto count = static_cast<std::int64_t>(triangles.size());
    std::vector<std::vector<Triangle>> found(static_cast<std::size_t>((count + kBlock - 1) / kBlock));
    executor.for_each(static_cast<std::int64_t>(found.size()), [&](std::int64_t block) {
        for (std::int64_t t = block * kBlock; t < std::min(count, (block + 1) * kBlock); ++t) {
            const Triangle& triangle = triangles[static_cast<std::size_t>(t)];
            if (smallest_area(positions, triangle, usable) > usable)
                found[static_cast<std::size_t>(block)].push_back(triangle);
        }
    });
    std::vector<Triangle> all;
    for (const auto& block : found) all.insert(all.end(), block.begin(), block.end());
    return all;
}

/// Of these triangles the one nearest to the seed in the first frame; of two the first.
Candidate nearest_of(PositionsView positions, std::span<const Triangle> triangles, std::int32_t seed) {
    Candidate best;
    double best_distance = std::numeric_limits<double>::infinity();
    for (const Triangle& t : triangles) {
        double distance = std::numeric_limits<double>::infinity();
        for (const std::int32_t v : t)
            distance = std::min(distance, squared_distance(positions.at(0, v), positions.at(0, seed)));
        if (distance < best_distance) {
            best.triangle = t;
            best_distance = distance;
        }
    }
    if (!triangles.empty()) best.area = smallest_area(positions, best.triangle, 0.0);
    return best;
}

Candidate best_incident(PositionsView positions, std::span<const Triangle> triangles,
                        std::span<const std::int32_t> incident) {
    Candidate best;
    for (const std::int32_t t : incident) consider(best, positions, triangles[static_cast<std::size_t>(t)]);
    return best;
}

}  // namespace

SeedTriangleChooser::SeedTriangleChooser(PositionsView positions, std::span<const Triangle> triangles,
                                         const VertexTriangles& vertex_triangles, double e_max)
    : positions_(positions),
      triangles_(triangles),
      vertex_triangles_(vertex_triangles),
      usable_(4.0 * (1e-10 * e_max * e_max) * (1e-10 * e_max * e_max)) {}

SeedTriangle SeedTriangleChooser::choose(std::int32_t seed, const Executor& executor) {
    Candidate best = best_incident(positions_, triangles_, vertex_triangles_.of(seed));
    SeedTriangle chosen;
    if (!(best.area > usable_)) {
        if (!triangles_.empty() && !all_usable_)
            all_usable_ = usable_triangles(positions_, triangles_, usable_, executor);
        Candidate other = triangles_.empty() ? best_of_points(positions_, seed)
                                             : nearest_of(positions_, *all_usable_, seed);
        if (other.area < 0.0 && best.area < 0.0) other = best_of_points(positions_, seed);  // isolated seed
        if (other.area > best.area || best.area < 0.0) {
            chosen.replaced = !triangles_.empty();
            best = other;
        }
    }
    chosen.vertices = best.triangle;
    chosen.degenerate = !(best.area > usable_);
    return chosen;
}

std::optional<Triangle> SeedTriangleChooser::incident_triangle(std::int32_t vertex) const {
    const Candidate best = best_incident(positions_.frames(0, 1), triangles_, vertex_triangles_.of(vertex));
    if (!(best.area > usable_) || !(smallest_area(positions_, best.triangle, usable_) > usable_))
        return std::nullopt;
    return best.triangle;
}

}  // namespace batchenc
