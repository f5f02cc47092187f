#include "kernels/signal_order.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace batchenc {
namespace {

constexpr int kCurveBits = 16;

/// The walk over one cluster, as far as it has come.
class Walk {
 public:
    Walk(const MeshAdjacency& adjacency, std::span<const std::int32_t> owner, std::int32_t cluster,
         std::span<std::int32_t> position)
        : adjacency_(adjacency), owner_(owner), cluster_(cluster), position_(position) {}

    void visit_component(std::int32_t root) {
        visit(root);
        way_.push_back(root);
        while (!way_.empty()) {
            const std::int32_t next = best_neighbour(way_.back());
            if (next < 0) {
                way_.pop_back();
            } else {
                visit(next);
                way_.push_back(next);
            }
        }
    }
    std::vector<std::int32_t> take() { return std::move(order_); }

 private:
    std::span<const std::int32_t> neighbours(std::int32_t vertex) const {
        const auto v = static_cast<std::size_t>(vertex);
        const auto first = static_cast<std::size_t>(adjacency_.first[v]);
        return std::span(adjacency_.neighbours)
            .subspan(first, static_cast<std::size_t>(adjacency_.first[v + 1]) - first);
    }
    bool is_free(std::int32_t vertex) const {
        const auto v = static_cast<std::size_t>(vertex);
        return owner_[v] == cluster_ && position_[v] < 0;
    }
    void visit(std::int32_t vertex) {
        position_[static_cast<std::size_t>(vertex)] = static_cast<std::int32_t>(order_.size());
        order_.push_back(vertex);
    }
    std::int32_t best_neighbour(std::int32_t vertex) const {
        std::int32_t best = -1;
        std::ptrdiff_t fewest = 0;
        for (const std::int32_t w : neighbours(vertex)) {
            if (!is_free(w)) continue;
            const auto around = neighbours(w);
            const std::ptrdiff_t free =
                std::count_if(around.begin(), around.end(), [&](std::int32_t u) { return is_free(u); });
            if (best < 0 || free < fewest) {
                best = w;
                fewest = free;
            }
        }
        return best;
    }

    const MeshAdjacency& adjacency_;
    std::span<const std::int32_t> owner_;
    std::int32_t cluster_;
    std::span<std::int32_t> position_;
    std::vector<std::int32_t> order_, way_;
};

/// Place along the curve of a cell.
std::uint64_t curve_place(std::array<std::uint32_t, 3> cell) {
    constexpr std::uint32_t kTop = 1u << (kCurveBits - 1);
    for (std::uint32_t bit = kTop; bit > 1; bit >>= 1) {
        const std::uint32_t below = bit - 1;
        for (std::uint32_t& x : cell) {
            if (x & bit) {
                cell[0] ^= below;
            } else {
                const std::uint32_t exchanged = (cell[0] ^ x) & below;
                cell[0] ^= exchanged;
                x ^= exchanged;
            }
        }
    }
    cell[1] ^= cell[0];
    cell[2] ^= cell[1];
    std::uint32_t flips = 0;
    for (std::uint32_t bit = kTop; bit > 1; bit >>= 1) {
        if (cell[2] & bit) flips ^= bit - 1;
    }
    std::uint64_t place = 0;
    for (int b = kCurveBits - 1; b >= 0; --b) {
        for (const std::uint32_t x : cell) place = place << 1 | ((x ^ flips) >> b & 1);
    }
    return place;
}

}  // namespace

ClusterTraversal walk_cluster(const MeshAdjacency& adjacency, std::span<const std::int32_t> members,
                              std::span<const std::int32_t> owner, std::int32_t cluster,
                              std::span<std::int32_t> position) {
    Walk walk(adjacency, owner, cluster, position);
    for (const std::int32_t root : members) {
        if (position[static_cast<std::size_t>(root)] < 0) walk.visit_component(root);
    }
    ClusterTraversal traversal;
    traversal.vertices = walk.take();
    traversal.predecessors.assign(members.size() * ClusterTraversal::kMaxPredecessors,
                                  static_cast<std::int32_t>(members.size()));
    traversal.predecessor_count.resize(members.size());
    for (std::size_t at = 0; at < members.size(); ++at) {
        const auto v = static_cast<std::size_t>(traversal.vertices[at]);
        std::int32_t* predecessors = traversal.predecessors.data() + at * ClusterTraversal::kMaxPredecessors;
        int count = 0;
        for (std::int32_t k = adjacency.first[v];
             k < adjacency.first[v + 1] && count < ClusterTraversal::kMaxPredecessors; ++k) {
            const auto w = static_cast<std::size_t>(adjacency.neighbours[static_cast<std::size_t>(k)]);
            if (owner[w] == cluster && position[w] < static_cast<std::int32_t>(at))
                predecessors[count++] = position[w];
        }
        traversal.predecessor_count[at] = static_cast<std::uint8_t>(count);
    }
    return traversal;
}

std::vector<std::int32_t> curve_order(std::span<const float> points) {
    std::vector<std::int32_t> order(points.size() / 3);
    std::iota(order.begin(), order.end(), 0);
    if (order.empty() || !std::all_of(points.begin(), points.end(), [](float x) { return std::isfinite(x); }))
        return order;
    std::array<double, 3> low, high;
    for (std::size_t c = 0; c < 3; ++c) low[c] = high[c] = static_cast<double>(points[c]);
    for (std::size_t k = 0; k < points.size(); ++k) {
        low[k % 3] = std::min(low[k % 3], static_cast<double>(points[k]));
        high[k % 3] = std::max(high[k % 3], static_cast<double>(points[k]));
    }
    const double side = std::max({high[0] - low[0], high[1] - low[1], high[2] - low[2]});
    if (!(side > 0.0)) return order;
    std::vector<std::uint64_t> places(order.size());
    for (std::size_t k = 0; k < order.size(); ++k) {
        std::array<std::uint32_t, 3> cell;
        for (std::size_t c = 0; c < 3; ++c) {
            const double part = (static_cast<double>(points[3 * k + c]) - low[c]) / side;
            cell[c] = static_cast<std::uint32_t>(part * ((1 << kCurveBits) - 1));
        }
        places[k] = curve_place(cell);
    }
    std::stable_sort(order.begin(), order.end(), [&](std::int32_t a, std::int32_t b) {
        return places[static_cast<std::size_t>(a)] < places[static_cast<std::size_t>(b)];
    });
    return order;
}

}  // namespace batchenc
