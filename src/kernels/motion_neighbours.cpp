#include "kernels/motion_neighbours.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "kernels/signal_order.h"

namespace batchenc {
namespace {

constexpr std::size_t kCount = MotionNeighbours::kCount;
using Rows = std::vector<std::vector<std::int32_t>>;

/// Neighbours of every vertex over edges in either direction, each once, ascending.
Rows neighbours_of(std::span<const Triangle> triangles, std::int64_t vertex_count) {
    Rows rows(static_cast<std::size_t>(vertex_count));
    for (const Triangle& t : triangles) {
        for (std::size_t k = 0; k < 3; ++k) {
            const std::int32_t a = t[k], b = t[(k + 1) % 3];
            if (a == b) continue;
            rows[static_cast<std::size_t>(a)].push_back(b);
            rows[static_cast<std::size_t>(b)].push_back(a);
        }
    }
    for (auto& row : rows) {
        std::sort(row.begin(), row.end());
        row.erase(std::unique(row.begin(), row.end()), row.end());
    }
    return rows;
}

/// Takes level after level of independent vertices out of a mesh, the finest first. Returns the level of each
/// vertex: 0 for those that stay, kLevels for those that went first.
///
/// Few neighbours go first, so that many can; where a vertex was, the first of its neighbours is joined to
/// the others, which keeps the mesh together.
std::vector<std::uint8_t> peel_levels(Rows rows, const std::vector<std::int32_t>& order) {
    constexpr std::size_t kFewest = 3, kMost = 8;
    std::vector<std::uint8_t> level(rows.size(), 0);
    std::vector<std::int32_t> rest = order;
    std::vector<std::uint8_t> is_barred(rows.size());
    const auto row_of = [&](std::int32_t v) -> std::vector<std::int32_t>& {
        return rows[static_cast<std::size_t>(v)];
    };
    for (int finest = MotionNeighbours::kLevels; finest > 0; --finest) {
        std::fill(is_barred.begin(), is_barred.end(), 0);
        std::vector<std::int32_t> taken;
        for (std::size_t degree = kFewest; degree <= kMost; ++degree) {
            for (const std::int32_t v : rest) {
                if (row_of(v).size() != degree || is_barred[static_cast<std::size_t>(v)]) continue;
                taken.push_back(v);
                is_barred[static_cast<std::size_t>(v)] = 1;
                for (const std::int32_t w : row_of(v)) is_barred[static_cast<std::size_t>(w)] = 1;
            }
        }
        for (const std::int32_t v : taken) {
            level[static_cast<std::size_t>(v)] = static_cast<std::uint8_t>(finest);
            const std::vector<std::int32_t>& ring = row_of(v);
            for (const std::int32_t w : ring) std::erase(row_of(w), v);
            for (std::size_t k = 1; k < ring.size(); ++k) {
                auto& hub = row_of(ring[0]);
                if (std::find(hub.begin(), hub.end(), ring[k]) != hub.end()) continue;
                hub.push_back(ring[k]);
                row_of(ring[k]).push_back(ring[0]);
            }
        }
        std::erase_if(rest, [&](std::int32_t v) { return level[static_cast<std::size_t>(v)] != 0; });
    }
    return level;
}

/// The way along a curve halves level by level.
std::vector<std::uint8_t> halve_levels(const std::vector<std::int32_t>& curve) {
    std::vector<std::uint8_t> level(curve.size());
    for (std::size_t k = 0; k < curve.size(); ++k) {
        const int zeros = k == 0 ? MotionNeighbours::kLevels : std::countr_zero(k);
        level[static_cast<std::size_t>(curve[k])] =
            static_cast<std::uint8_t>(MotionNeighbours::kLevels - std::min(zeros, MotionNeighbours::kLevels));
    }
    return level;
}

/// Finds what a vertex is predicted from.
class Search {
 public:
    Search(const Rows& rows, const std::vector<std::int32_t>& curve, std::span<const float> points,
           const std::vector<std::int32_t>& place, const std::vector<std::uint8_t>& level)
        : rows_(rows), curve_(curve), points_(points), place_(place), level_(level), at_(curve.size()) {
        for (std::size_t k = 0; k < curve.size(); ++k)
            at_[static_cast<std::size_t>(curve[k])] = static_cast<std::int32_t>(k);
    }

    struct Scratch {
        std::vector<std::int32_t> seen_by;  // V, of whom a vertex was seen last
        std::vector<std::int32_t> ring, next;
        struct Candidate {
            double distance;    // squared
            std::int32_t ring;  // 1 over an edge; 2 along the curve
            std::int32_t vertex;
        };
        std::vector<Candidate> found;
    };

    /// Fills places and weights of one vertex.
    void find(std::int32_t v, Scratch& scratch, std::int32_t* places, float* weights) const {
        auto& found = scratch.found;
        found.clear();
        walk_rings(v, scratch);
        if (found.size() < kFew) {
            found.clear();
            walk_curve(v, found);
        }
        // First neighbours over an edge, then by distance; equal ones by number.
        std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) {
            const bool a_far = a.ring > 1, b_far = b.ring > 1;
            if (a_far != b_far) return b_far;
            return a.distance != b.distance ? a.distance < b.distance : a.vertex < b.vertex;
        });
        const std::size_t count = std::min(kCount, found.size());
        for (std::size_t k = 0; k < kCount; ++k) {
            places[k] = k < count ? place_[static_cast<std::size_t>(found[k].vertex)]
                                  : static_cast<std::int32_t>(place_.size());
            weights[k] = 0.0f;
        }
        krige(std::span(found).first(count), weights);
    }

 private:
    static constexpr std::size_t kFew = 4;

    bool is_before(std::int32_t w, std::int32_t v) const {
        const auto a = static_cast<std::size_t>(w), b = static_cast<std::size_t>(v);
        return level_[b] == 0 ? place_[a] < place_[b] : level_[a] < level_[b];
    }
    double squared_distance_between(std::int32_t a, std::int32_t b) const {
        double sum = 0.0;
        for (std::size_t c = 0; c < 3; ++c) {
            const double d = static_cast<double>(points_[3 * static_cast<std::size_t>(a) + c]) -
                             static_cast<double>(points_[3 * static_cast<std::size_t>(b) + c]);
            sum += d * d;
        }
        return sum;
    }

    /// Over the mesh, ring by ring, until there are enough.
    void walk_rings(std::int32_t v, Scratch& scratch) const {
        constexpr std::int32_t kMostRings = 6;
        scratch.ring.assign(1, v);
        scratch.seen_by[static_cast<std::size_t>(v)] = v;
        for (std::int32_t r = 1; r <= kMostRings && !scratch.ring.empty(); ++r) {
            scratch.next.clear();
            for (const std::int32_t u : scratch.ring) {
                for (const std::int32_t w : rows_[static_cast<std::size_t>(u)]) {
                    std::int32_t& seen_by = scratch.seen_by[static_cast<std::size_t>(w)];
                    if (seen_by == v) continue;
                    seen_by = v;
                    scratch.next.push_back(w);
                    if (is_before(w, v)) scratch.found.push_back({squared_distance_between(v, w), r, w});
                }
            }
            scratch.ring.swap(scratch.next);
            if ((r >= 2 && scratch.found.size() >= kCount) || scratch.found.size() >= 3 * kCount) return;
            if (scratch.ring.size() > kMostInARing) return;
        }
    }
    static constexpr std::size_t kMostInARing = 512;  // hubs make rings as large as the mesh

    /// Along the curve, both ways: for points, and where a component of the mesh has too few.
    void walk_curve(std::int32_t v, std::vector<Scratch::Candidate>& found) const {
        constexpr std::int64_t kReach = 256;
        constexpr int kWanted = 12;  // on each side
        const std::int64_t at = at_[static_cast<std::size_t>(v)];
        const auto count = static_cast<std::int64_t>(curve_.size());
        for (const std::int64_t step : {-1, 1}) {
            int taken = 0;
            for (std::int64_t k = at + step; k >= 0 && k < count && taken < kWanted; k += step) {
                if (k - at > kReach || at - k > kReach) break;
                const std::int32_t w = curve_[static_cast<std::size_t>(k)];
                if (!is_before(w, v)) continue;
                found.push_back({squared_distance_between(v, w), 2, w});
                ++taken;
            }
        }
    }

    /// Correlation over a squared distance, of an own scale; any smooth falling form does.
    static double correlation(double squared, double scale) {
        const double x = 1.0 + squared / scale;
        return 1.0 / (x * x);
    }

    /// Weights of ordinary kriging: solves (C + nugget) w = c by elimination with the large constant that
    /// makes them sum to about one, and then makes them do so.
    void krige(std::span<const Scratch::Candidate> from, float* weights) const {
        const std::size_t n = from.size();
        if (n == 0) return;
        constexpr double kMean = 10.0, kNugget = 0.005;
        double mean_distance = 0.0;
        for (const auto& candidate : from) mean_distance += std::sqrt(candidate.distance);
        mean_distance = mean_distance / static_cast<double>(n);
        const double scale = 32.0 * (mean_distance * mean_distance) + 1e-60;
        std::array<std::array<double, kCount + 1>, kCount> a;
        for (std::size_t i = 0; i < n; ++i) {
            for (std::size_t j = 0; j < i; ++j)
                a[i][j] = a[j][i] =
                    kMean + correlation(squared_distance_between(from[i].vertex, from[j].vertex), scale);
            a[i][i] = kMean + 1.0 + kNugget;
            a[i][n] = kMean + correlation(from[i].distance, scale);
        }
        for (std::size_t k = 0; k < n; ++k) {  // positive definite: needs no pivots
            for (std::size_t i = k + 1; i < n; ++i) {
                const double factor = a[i][k] / a[k][k];
                for (std::size_t j = k + 1; j <= n; ++j) a[i][j] = a[i][j] - factor * a[k][j];
            }
        }
        std::array<double, kCount> w{};
        double sum = 0.0;
        for (std::size_t i = n; i-- > 0;) {
            double value = a[i][n];
            for (std::size_t j = i + 1; j < n; ++j) value = value - a[i][j] * w[j];
            w[i] = value / a[i][i];
            sum += w[i];
        }
        const bool is_sound = sum > 0.1 && sum < 10.0;  // neither for NaN
        for (std::size_t i = 0; i < n; ++i)
            weights[i] = static_cast<float>(is_sound ? w[i] / sum : 1.0 / static_cast<double>(n));
    }

    const Rows& rows_;
    const std::vector<std::int32_t>& curve_;
    std::span<const float> points_;
    const std::vector<std::int32_t>& place_;
    const std::vector<std::uint8_t>& level_;
    std::vector<std::int32_t> at_;  // where on the curve a vertex is
};

}  // namespace

MotionNeighbours MotionNeighbours::of(const MeshTopology& mesh, std::span<const float> first_frame,
                                      const Executor& executor) {
    const auto vertex_count = static_cast<std::size_t>(mesh.vertex_count());
    const std::vector<std::int32_t> curve = curve_order(first_frame);
    const Rows rows = neighbours_of(mesh.triangles(), mesh.vertex_count());
    const std::vector<std::int32_t>& base = mesh.is_points() ? curve : mesh.traversal().order;
    const std::vector<std::uint8_t> level = mesh.is_points() ? halve_levels(curve) : peel_levels(rows, base);

    MotionNeighbours result;
    result.order.reserve(vertex_count);
    for (int l = 0; l <= kLevels; ++l) {
        result.level_first.push_back(static_cast<std::int32_t>(result.order.size()));
        for (const std::int32_t v : base)
            if (level[static_cast<std::size_t>(v)] == l) result.order.push_back(v);
    }
    result.level_first.push_back(static_cast<std::int32_t>(vertex_count));
    std::vector<std::int32_t> place(vertex_count);
    for (std::size_t k = 0; k < vertex_count; ++k)
        place[static_cast<std::size_t>(result.order[k])] = static_cast<std::int32_t>(k);

    result.places.resize(vertex_count * kCount);
    result.weights.resize(vertex_count * kCount);
    const Search search(rows, curve, first_frame, place, level);
    constexpr std::int64_t kBlock = 16384;
    executor.for_each((mesh.vertex_count() + kBlock - 1) / kBlock, [&](std::int64_t b) {
        Search::Scratch scratch;
        scratch.seen_by.assign(vertex_count, -1);
        const auto end = std::min(static_cast<std::size_t>((b + 1) * kBlock), vertex_count);
        for (auto k = static_cast<std::size_t>(b * kBlock); k < end; ++k)
            search.find(result.order[k], scratch, result.places.data() + k * kCount,
                        result.weights.data() + k * kCount);
    });
    return result;
}

}  // namespace batchenc
