#include "kernels/surface.h"

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

namespace batchenc {
namespace {

constexpr std::int32_t kNone = -1;

struct Edge {
    std::uint64_t ends;  // the smaller vertex above the larger
    std::int32_t half_edge;
};

/// Sorts by `ends`, equal ones in their order.
void radix_sort(std::vector<Edge>& edges) {
    std::vector<Edge> other(edges.size());
    for (unsigned shift = 0; shift < 64; shift += 16) {
        std::vector<std::size_t> first((1 << 16) + 1, 0);
        for (const Edge& e : edges) ++first[((e.ends >> shift) & 0xffff) + 1];
        if (std::find(first.begin(), first.end(), edges.size()) != first.end())
            continue;  // one digit for all
        for (std::size_t digit = 0; digit < (1 << 16); ++digit) first[digit + 1] += first[digit];
        for (const Edge& e : edges) other[first[(e.ends >> shift) & 0xffff]++] = e;
        edges.swap(other);
    }
}

class Gluing {
 public:
    explicit Gluing(std::span<const Triangle> triangles) : source_(triangles) {
        surface_.triangles.assign(triangles.begin(), triangles.end());
        surface_.is_flipped.assign(triangles.size(), 0);
        surface_.twin.assign(3 * triangles.size(), kNone);
        surface_.fan.assign(3 * triangles.size(), kNone);
    }

    Surface run() {
        list_edges();
        glue_plain_edges();
        orient();
        glue_other_edges();
        find_fans();
        return std::move(surface_);
    }

 private:
    std::int32_t& twin(std::int32_t h) { return surface_.twin[static_cast<std::size_t>(h)]; }
    std::int32_t end(std::int32_t h) const { return surface_.start(Surface::next(h)); }

    void list_edges() {
        for (std::size_t t = 0; t < source_.size(); ++t) {
            const Triangle& corners = source_[t];
            if (corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0]) continue;
            for (std::size_t k = 0; k < 3; ++k) {
                const auto [low, high] = std::minmax(corners[k], corners[(k + 1) % 3]);
                edges_.push_back({static_cast<std::uint64_t>(low) << 32 | static_cast<std::uint32_t>(high),
                                  static_cast<std::int32_t>(3 * t + k)});
            }
        }
        radix_sort(edges_);
    }

    /// Calls use(begin, end) for the edges with the same ends.
    template <typename Use>
    void for_each_run(Use use) {
        for (std::size_t begin = 0, end; begin < edges_.size(); begin = end) {
            for (end = begin + 1; end < edges_.size() && edges_[end].ends == edges_[begin].ends;) ++end;
            use(begin, end);
        }
    }

    /// Edges of two triangles, whichever way they are wound.
    void glue_plain_edges() {
        for_each_run([&](std::size_t begin, std::size_t end) {
            if (end - begin != 2) return;
            twin(edges_[begin].half_edge) = edges_[begin + 1].half_edge;
            twin(edges_[begin + 1].half_edge) = edges_[begin].half_edge;
        });
    }

    /// Winds triangles that are glued alike, as the first of each piece is; cuts where that cannot be.
    void orient() {
        std::vector<std::uint8_t> is_seen(source_.size(), 0);
        std::vector<std::int32_t> waiting;
        const auto runs_forward = [&](std::int32_t h) { return source_start(h) < source_end(h); };
        for (std::size_t first = 0; first < source_.size(); ++first) {
            if (is_seen[first]) continue;
            is_seen[first] = 1;
            waiting.assign(1, static_cast<std::int32_t>(first));
            while (!waiting.empty()) {
                const std::int32_t t = waiting.back();
                waiting.pop_back();
                for (std::int32_t h = 3 * t; h < 3 * t + 3; ++h) {
                    const std::int32_t other = twin(h);
                    if (other == kNone) continue;
                    const auto n = static_cast<std::size_t>(other / 3);
                    const bool differs = runs_forward(h) == runs_forward(other);
                    const auto flip =
                        static_cast<std::uint8_t>(surface_.is_flipped[static_cast<std::size_t>(t)] ^
                                                  static_cast<std::uint8_t>(differs));
                    if (!is_seen[n]) {
                        is_seen[n] = 1;
                        surface_.is_flipped[n] = flip;
                        waiting.push_back(other / 3);
                    } else if (surface_.is_flipped[n] != flip) {
                        twin(h) = twin(other) = kNone;
                    }
                }
            }
        }
        // Exchanging the last two corners makes half-edges 0, 1, 2 those that were 2, 1, 0.
        const auto renamed = [&](std::int32_t h) {
            return h == kNone || !surface_.is_flipped[static_cast<std::size_t>(h / 3)]
                       ? h
                       : h - h % 3 + 2 - h % 3;
        };
        std::vector<std::int32_t> twins(surface_.twin.size());
        for (std::size_t h = 0; h < twins.size(); ++h)
            twins[static_cast<std::size_t>(renamed(static_cast<std::int32_t>(h)))] =
                renamed(surface_.twin[h]);
        surface_.twin = std::move(twins);
        for (Edge& e : edges_) e.half_edge = renamed(e.half_edge);
        for (std::size_t t = 0; t < source_.size(); ++t) {
            if (surface_.is_flipped[t]) std::swap(surface_.triangles[t][1], surface_.triangles[t][2]);
        }
    }

    /// Edges of more triangles: each is glued to the first that runs the other way and is still free.
    void glue_other_edges() {
        std::array<std::vector<std::int32_t>, 2> free;  // by direction
        for_each_run([&](std::size_t begin, std::size_t end) {
            if (end - begin < 3) return;
            for (auto& direction : free) direction.clear();
            for (std::size_t i = begin; i < end; ++i) {
                const std::int32_t h = edges_[i].half_edge;
                free[surface_.start(h) < this->end(h) ? 1 : 0].push_back(h);
            }
            const std::size_t pairs = std::min(free[0].size(), free[1].size());
            for (std::size_t i = 0; i < pairs; ++i) {
                twin(free[0][i]) = free[1][i];
                twin(free[1][i]) = free[0][i];
            }
        });
    }

    void find_fans() {
        for (std::int32_t first = 0; static_cast<std::size_t>(first) < surface_.fan.size(); ++first) {
            if (fan(first) != kNone) continue;
            // Back to the fan's beginning, where it has one; then around.
            std::int32_t h = first;
            bool is_open = false;
            for (;;) {
                const std::int32_t before = twin(h);
                if (before == kNone) {
                    is_open = true;
                    break;
                }
                h = Surface::next(before);
                if (h == first) break;
            }
            const auto number = static_cast<std::int32_t>(surface_.fan_size.size());
            std::int32_t size = 0;
            do {
                fan(h) = number;
                ++size;
                h = twin(Surface::previous(h));
            } while (h != kNone && fan(h) == kNone);
            surface_.fan_size.push_back(size);
            surface_.fan_is_open.push_back(is_open ? 1 : 0);
        }
    }

    std::int32_t& fan(std::int32_t h) { return surface_.fan[static_cast<std::size_t>(h)]; }
    std::int32_t source_start(std::int32_t h) const {
        return source_[static_cast<std::size_t>(h / 3)][static_cast<std::size_t>(h % 3)];
    }
    std::int32_t source_end(std::int32_t h) const { return source_start(Surface::next(h)); }

    std::span<const Triangle> source_;
    std::vector<Edge> edges_;
    Surface surface_;
};

}  // namespace

Surface Surface::of(std::span<const Triangle> triangles) { return Gluing(triangles).run(); }

}  // namespace batchenc
