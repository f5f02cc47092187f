#include "kernels/mesh_traversal.h"

#include <algorithm>
#include <array>
#include <deque>
#include <optional>

#include "kernels/vertex_triangles.h"

namespace batchenc {
namespace {

constexpr int kMostReady = 3;  // triangles that count for a vertex' turn; more make no difference

class Walk {
 public:
    Walk(std::span<const Triangle> triangles, std::int64_t vertex_count)
        : triangles_(triangles),
          vertex_triangles_(triangles, vertex_count),
          is_done_(static_cast<std::size_t>(vertex_count), false),
          ready_(static_cast<std::size_t>(vertex_count), 0) {
        traversal_.order.reserve(is_done_.size());
        traversal_.anchor.reserve(is_done_.size());
        traversal_.first_gate.reserve(is_done_.size() + 1);
        traversal_.first_gate.push_back(0);
    }

    MeshTraversal run() {
        for (const Triangle& t : triangles_) {
            std::int32_t anchor = last();
            for (const std::int32_t v : t) {
                if (!is_done(v)) visit(v, anchor);
                anchor = v;
            }
            while (const auto next = take_next()) visit(*next, last());
        }
        for (std::size_t v = 0; v < is_done_.size(); ++v) {
            if (!is_done_[v]) visit(static_cast<std::int32_t>(v), last());
        }
        return std::move(traversal_);
    }

 private:
    bool is_done(std::int32_t v) const { return is_done_[static_cast<std::size_t>(v)]; }
    std::int32_t last() const { return traversal_.order.empty() ? -1 : traversal_.order.back(); }

    std::optional<std::int32_t> take_next() {
        for (std::size_t turn = kMostReady; turn-- > 0;) {
            while (!queues_[turn].empty()) {
                const std::int32_t v = queues_[turn].front();
                queues_[turn].pop_front();
                if (!is_done(v)) return v;
            }
        }
        return std::nullopt;
    }

    void visit(std::int32_t v, std::int32_t anchor) {
        find_gates(v);
        traversal_.order.push_back(v);
        traversal_.anchor.push_back(anchor);
        traversal_.first_gate.push_back(static_cast<std::int32_t>(traversal_.gates.size()));
        is_done_[static_cast<std::size_t>(v)] = true;
        for (const std::int32_t number : vertex_triangles_.of(v)) {
            std::int32_t missing = -1;
            int missing_count = 0;
            for (const std::int32_t corner : triangles_[static_cast<std::size_t>(number)]) {
                if (is_done(corner)) continue;
                missing = corner;
                ++missing_count;
            }
            if (missing_count != 1) continue;
            std::uint8_t& ready = ready_[static_cast<std::size_t>(missing)];
            if (ready == kMostReady) continue;
            queues_[ready++].push_back(missing);
        }
    }

    void find_gates(std::int32_t v) {
        const std::size_t begin = traversal_.gates.size();
        Gate edge;
        for (const std::int32_t number : vertex_triangles_.of(v)) {
            std::int32_t left = -1, right = -1;
            if (!other_corners(triangles_[static_cast<std::size_t>(number)], v, left, right)) continue;
            if (!is_done(left) || !is_done(right)) continue;
            const Gate gate = across(left, right, v);
            if (gate.opposite < 0) {
                edge = gate;
            } else {
                traversal_.gates.push_back(gate);
                if (traversal_.gates.size() - begin == MeshTraversal::kMostGates) return;
            }
        }
        if (traversal_.gates.size() == begin && edge.left >= 0) traversal_.gates.push_back(edge);
    }

    /// The two corners of a triangle after `v`, as wound; false for a degenerate one.
    static bool other_corners(const Triangle& t, std::int32_t v, std::int32_t& left, std::int32_t& right) {
        const std::size_t k = t[0] == v ? 0 : t[1] == v ? 1 : 2;
        left = t[(k + 1) % 3];
        right = t[(k + 2) % 3];
        return left != v && right != v && left != right;
    }

    /// The gate at an edge: over the first decoded triangle there that `v` is no corner of, if there is one.
    Gate across(std::int32_t left, std::int32_t right, std::int32_t v) const {
        for (const std::int32_t number : vertex_triangles_.of(left)) {
            const Triangle& t = triangles_[static_cast<std::size_t>(number)];
            std::int32_t a = -1, b = -1;
            if (!other_corners(t, left, a, b)) continue;
            const std::int32_t third = a == right ? b : b == right ? a : -1;
            if (third >= 0 && third != v && is_done(third)) return {left, right, third, number};
        }
        return {left, right, -1, -1};
    }

    std::span<const Triangle> triangles_;
    VertexTriangles vertex_triangles_;
    std::vector<bool> is_done_;
    std::vector<std::uint8_t> ready_;  // triangles whose other corners are decoded, to kMostReady
    std::array<std::deque<std::int32_t>, kMostReady> queues_;
    MeshTraversal traversal_;
};

std::vector<std::int32_t> places_of(const std::vector<std::int32_t>& order) {
    std::vector<std::int32_t> places(order.size());
    for (std::size_t k = 0; k < order.size(); ++k)
        places[static_cast<std::size_t>(order[k])] = static_cast<std::int32_t>(k);
    return places;
}

}  // namespace

std::vector<Triangle> MeshTraversal::in_places(std::span<const Triangle> triangles) const {
    const std::vector<std::int32_t> places = places_of(order);
    std::vector<Triangle> renamed(triangles.begin(), triangles.end());
    for (Triangle& t : renamed) {
        for (std::int32_t& v : t) v = places[static_cast<std::size_t>(v)];
    }
    return renamed;
}

MeshTraversal MeshTraversal::of(std::span<const Triangle> triangles, std::int64_t vertex_count) {
    MeshTraversal traversal = Walk(triangles, vertex_count).run();
    const std::vector<std::int32_t> places = places_of(traversal.order);
    const auto rename = [&](std::int32_t& v) { v = v < 0 ? v : places[static_cast<std::size_t>(v)]; };
    for (Gate& gate : traversal.gates) {
        rename(gate.left);
        rename(gate.right);
        rename(gate.opposite);
    }
    for (std::int32_t& v : traversal.anchor) rename(v);
    return traversal;
}

}  // namespace batchenc
