#include "kernels/seeds.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

#include "kernels/bounding_box.h"

namespace batchenc {
namespace {

double squared_distance(const float* a, const float* b) {
    double sum = 0.0;
    for (int c = 0; c < 3; ++c) {
        const double d = static_cast<double>(a[c]) - b[c];
        sum += d * d;
    }
    return sum;
}

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

}  // namespace

std::vector<std::int32_t> farthest_point_seeds(PositionsView frame, std::int32_t count) {
    const std::int64_t vertex_count = frame.vertex_count();
    const auto centroid = frame.frame(0).cast<double>().rowwise().mean().eval();
    std::vector<double> distance(static_cast<std::size_t>(vertex_count));
    for (std::int64_t v = 0; v < vertex_count; ++v) {
        distance[static_cast<std::size_t>(v)] =
            (frame.frame(0).col(v).cast<double>() - centroid).squaredNorm();
    }
    std::vector<std::int32_t> seeds;
    const auto farthest = [&] {
        return static_cast<std::int32_t>(std::max_element(distance.begin(), distance.end()) -
                                         distance.begin());
    };
    seeds.push_back(farthest());
    std::fill(distance.begin(), distance.end(), std::numeric_limits<double>::infinity());
    while (static_cast<std::int32_t>(seeds.size()) < count) {
        const float* last = frame.at(0, seeds.back());
        for (std::int64_t v = 0; v < vertex_count; ++v) {
            double& d = distance[static_cast<std::size_t>(v)];
            d = std::min(d, squared_distance(frame.at(0, v), last));
        }
        const std::int32_t next = farthest();
        if (!(distance[static_cast<std::size_t>(next)] > 0.0)) break;  // every vertex sits on a seed
        seeds.push_back(next);
    }
    return seeds;
}

std::vector<SeedTriangle> choose_seed_triangles(PositionsView positions, std::span<const Triangle> triangles,
                                                std::span<const std::int32_t> seeds,
                                                const Executor& executor) {
    const double side = bounding_box(positions).largest_side();
    const double usable = 4.0 * (1e-10 * side * side) * (1e-10 * side * side);  // in squared doubled areas

    // Incident triangles of the seeds alone: one pass over the triangles.
    std::vector<std::int32_t> seed_of(static_cast<std::size_t>(positions.vertex_count()), -1);
    for (std::size_t i = 0; i < seeds.size(); ++i)
        seed_of[static_cast<std::size_t>(seeds[i])] = static_cast<std::int32_t>(i);
    std::vector<Candidate> best(seeds.size());
    for (const Triangle& t : triangles) {
        for (const std::int32_t v : t) {
            const std::int32_t i = seed_of[static_cast<std::size_t>(v)];
            if (i >= 0) consider(best[static_cast<std::size_t>(i)], positions, t);
        }
    }
    std::vector<SeedTriangle> chosen(seeds.size());
    std::optional<std::vector<Triangle>> elsewhere;
    for (std::size_t i = 0; i < seeds.size(); ++i) {
        if (!(best[i].area > usable)) {
            if (!triangles.empty() && !elsewhere)
                elsewhere = usable_triangles(positions, triangles, usable, executor);
            Candidate other = triangles.empty() ? best_of_points(positions, seeds[i])
                                                : nearest_of(positions, *elsewhere, seeds[i]);
            if (other.area < 0.0 && best[i].area < 0.0)
                other = best_of_points(positions, seeds[i]);  // isolated seed
            if (other.area > best[i].area || best[i].area < 0.0) {
                chosen[i].replaced = !triangles.empty();
                best[i] = other;
            }
        }
        chosen[i].vertices = best[i].triangle;
        chosen[i].degenerate = !(best[i].area > usable);
    }
    return chosen;
}

}  // namespace batchenc
