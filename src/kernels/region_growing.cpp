#include "kernels/region_growing.h"

#include <algorithm>
#include <functional>
#include <queue>
#include <tuple>

namespace batchenc {
namespace {

/// A triangle beyond the border of a region; the smallest comes out of a queue first.
struct Candidate {
    double distance = 0.0;  // squared, of the vertex from the seed
    std::int32_t vertex = 0;
    std::int32_t triangle = 0;
    bool operator>(const Candidate& other) const {
        return std::tie(distance, vertex, triangle) > std::tie(other.distance, other.vertex, other.triangle);
    }
};

using Queue = std::priority_queue<Candidate, std::vector<Candidate>, std::greater<>>;

struct Region {
    const float* seed = nullptr;  // its position
    Queue queue;
};

class Growth {
 public:
    Growth(std::span<const float> positions, std::span<const Triangle> triangles,
           const VertexTriangles& vertex_triangles)
        : positions_(positions),
          triangles_(triangles),
          vertex_triangles_(vertex_triangles),
          labels_(positions.size() / 3, -1),
          visited_(triangles.size(), false) {}

    std::vector<std::int32_t> run(std::span<const std::int32_t> seeds,
                                  std::span<const Triangle> seed_triangles) {
        regions_.resize(seeds.size());
        for (std::size_t i = 0; i < seeds.size(); ++i) {
            regions_[i].seed = at(seeds[i]);
            for (const std::int32_t v : seed_triangles[i]) {
                if (label(v) < 0) label(v) = static_cast<std::int32_t>(i);
            }
        }
        for (std::size_t i = 0; i < seeds.size(); ++i) push_neighbours(regions_[i], seed_triangles[i]);
        for (bool grown = true; grown;) {
            grown = false;
            for (std::size_t i = 0; i < regions_.size(); ++i) grown |= take_turn(i);
        }
        give_away_unreached();
        return std::move(labels_);
    }

 private:
    const float* at(std::int32_t v) const { return positions_.data() + 3 * static_cast<std::ptrdiff_t>(v); }
    std::int32_t& label(std::int32_t v) { return labels_[static_cast<std::size_t>(v)]; }

    /// Queues every unvisited triangle at one of the three edges.
    void push_neighbours(Region& region, const Triangle& t) {
        for (std::size_t k = 0; k < 3; ++k) {
            const std::int32_t a = t[k], b = t[(k + 1) % 3];
            if (a == b) continue;
            for (const std::int32_t number : vertex_triangles_.of(a)) {
                if (visited_[static_cast<std::size_t>(number)]) continue;
                const Triangle& other = triangles_[static_cast<std::size_t>(number)];
                if (std::find(other.begin(), other.end(), b) == other.end()) continue;
                for (const std::int32_t v : other) {
                    if (v != a && v != b)
                        region.queue.push({squared_distance(at(v), region.seed), v, number});
                }
            }
        }
    }

    /// Adds the nearest candidate vertex; false when there is none. Triangles that bring no new vertex are
    /// passed on the way.
    bool take_turn(std::size_t index) {
        Region& region = regions_[index];
        while (!region.queue.empty()) {
            const Candidate next = region.queue.top();
            region.queue.pop();
            if (visited_[static_cast<std::size_t>(next.triangle)]) continue;
            visited_[static_cast<std::size_t>(next.triangle)] = true;
            const bool is_new = label(next.vertex) < 0;
            if (is_new) label(next.vertex) = static_cast<std::int32_t>(index);
            if (label(next.vertex) != static_cast<std::int32_t>(index)) continue;
            push_neighbours(region, triangles_[static_cast<std::size_t>(next.triangle)]);
            if (is_new) return true;
        }
        return false;
    }

    void give_away_unreached() {
        std::vector<std::int32_t> component;
        for (std::int32_t root = 0; root < static_cast<std::int32_t>(labels_.size()); ++root) {
            if (label(root) >= 0) continue;
            component.assign(1, root);
            label(root) = 0;  // reached now; the right number follows
            std::array<double, 3> sum{};
            for (std::size_t k = 0; k < component.size(); ++k) {
                for (std::size_t axis = 0; axis < 3; ++axis)
                    sum[axis] += static_cast<double>(at(component[k])[axis]);
                for (const std::int32_t number : vertex_triangles_.of(component[k])) {
                    for (const std::int32_t v : triangles_[static_cast<std::size_t>(number)]) {
                        if (label(v) >= 0) continue;
                        label(v) = 0;
                        component.push_back(v);
                    }
                }
            }
            std::array<float, 3> centre;
            for (std::size_t axis = 0; axis < 3; ++axis)
                centre[axis] = static_cast<float>(sum[axis] / static_cast<double>(component.size()));
            const auto nearest =
                std::min_element(regions_.begin(), regions_.end(), [&](const Region& a, const Region& b) {
                    return squared_distance(a.seed, centre.data()) < squared_distance(b.seed, centre.data());
                });
            for (const std::int32_t v : component)
                label(v) = static_cast<std::int32_t>(nearest - regions_.begin());
        }
    }

    std::span<const float> positions_;
    std::span<const Triangle> triangles_;
    const VertexTriangles& vertex_triangles_;
    std::vector<std::int32_t> labels_;
    std::vector<bool> visited_;
    std::vector<Region> regions_;
};

}  // namespace

std::vector<float> mean_positions(PositionsView positions, const Executor& executor) {
    constexpr std::int64_t kBlock = 1024;  // values whose sums stay in L1 while the frames pass
    const std::int64_t count = 3 * positions.vertex_count();
    std::vector<float> means(static_cast<std::size_t>(count));
    executor.for_each((count + kBlock - 1) / kBlock, [&](std::int64_t block) {
        const std::int64_t begin = block * kBlock, size = std::min(kBlock, count - begin);
        double sums[kBlock] = {};
        for (std::int64_t f = 0; f < positions.frame_count(); ++f) {
            const float* p = positions.at(f, 0) + begin;
            for (std::int64_t k = 0; k < size; ++k) sums[k] += static_cast<double>(p[k]);
        }
        for (std::int64_t k = 0; k < size; ++k)
            means[static_cast<std::size_t>(begin + k)] =
                static_cast<float>(sums[k] / static_cast<double>(positions.frame_count()));
    });
    return means;
}

std::vector<std::int32_t> grow_regions(std::span<const float> positions, std::span<const Triangle> triangles,
                                       const VertexTriangles& vertex_triangles,
                                       std::span<const std::int32_t> seeds,
                                       std::span<const Triangle> seed_triangles) {
    return Growth(positions, triangles, vertex_triangles).run(seeds, seed_triangles);
}

}  // namespace batchenc
