#include "kernels/surface_coder.h"

#include <algorithm>
#include <array>
#include <limits>
#include <optional>
#include <unordered_map>
#include <utility>

namespace batchenc {
namespace {

constexpr std::int32_t kNone = -1;
constexpr int kNearSteps = 64;  // along the front, to a third corner that is there already
constexpr int kQueues = 16;

// What is known of a fan, as a context: 0 none, then closed by size, then open by size.
constexpr std::size_t kFanKinds = 16;

/// Numbers of vertices, by index; memory follows the triangles where few of many indices are used.
class VertexNumbers {
 public:
    explicit VertexNumbers(std::span<const Triangle> triangles) {
        std::int64_t largest = kNone;
        for (const Triangle& t : triangles) largest = std::max<std::int64_t>({largest, t[0], t[1], t[2]});
        if (largest < 24 * static_cast<std::int64_t>(triangles.size()))
            by_index_.assign(static_cast<std::size_t>(largest + 1), kNone);
    }
    /// kNone for one that has none.
    std::int32_t of(std::int32_t vertex) const {
        const auto v = static_cast<std::size_t>(vertex);
        if (vertex == kNone || v < by_index_.size()) return vertex == kNone ? kNone : by_index_[v];
        const auto found = sparse_.find(vertex);
        return found == sparse_.end() ? kNone : found->second;
    }
    void set(std::int32_t vertex, std::int32_t number) {
        const auto v = static_cast<std::size_t>(vertex);
        if (v < by_index_.size())
            by_index_[v] = number;
        else
            sparse_.emplace(vertex, number);
    }

 private:
    std::vector<std::int32_t> by_index_;
    std::unordered_map<std::int32_t, std::int32_t> sparse_;
};

// What one walk over the surface keeps; encoder and decoder make the same one. The front is closed loops of
// edges, each running as the triangle that is to be placed across it.
class Walk {
 public:
    /// surface: to encode; none to decode.
    Walk(BitCoder& coder, const Surface* surface, std::int64_t triangle_count, std::int64_t vertex_count)
        : coder_(coder),
          surface_(surface),
          triangle_count_(triangle_count),
          vertex_count_(vertex_count),
          numbers_(surface ? std::span<const Triangle>(surface->triangles) : std::span<const Triangle>()) {
        if (!surface_) return;
        fan_made_.assign(surface_->fan_size.size(), kNone);
        edge_of_half_.assign(surface_->twin.size(), kNone);
        is_placed_.assign(surface_->triangles.size(), 0);
    }

    /// False where the stream is corrupt.
    bool run() {
        while (!is_full()) {
            if (!start_piece()) return false;
            while (const auto gate = take_gate()) {
                if (!pass(*gate) || coder_.is_overrun()) return false;
            }
        }
        return !coder_.is_overrun();
    }

    CodedSurface take() { return std::move(coded_); }

 private:
    struct Fan {
        std::int32_t vertex = 0, size = 0;
        std::int32_t left = 0;    // triangles that are not placed yet
        std::int32_t wedges = 1;  // how often the front passes it
        bool is_open = false;
        std::uint8_t borders = 0;  // edges of the front at it that were found to be borders, to 3
    };
    struct FrontEdge {
        std::int32_t from = 0;    // fan
        std::int32_t behind = 0;  // fan: third corner of the placed triangle
        std::int32_t previous = 0, next = 0;
        bool is_active = true, is_border = false;
    };

    bool is_full() const { return static_cast<std::int64_t>(coded_.triangles.size()) >= triangle_count_; }
    Fan& fan(std::int32_t f) { return fans_[static_cast<std::size_t>(f)]; }
    FrontEdge& edge(std::int32_t e) { return edges_[static_cast<std::size_t>(e)]; }
    std::int32_t to(std::int32_t e) { return edge(edge(e).next).from; }
    void link(std::int32_t e, std::int32_t next) {
        edge(e).next = next;
        edge(next).previous = e;
    }

    // Of half-edges of the surface; none when decoding, where every half-edge is none.
    std::int32_t twin_of(std::int32_t half) const {
        return half == kNone ? kNone : surface_->twin[static_cast<std::size_t>(half)];
    }
    static std::int32_t next_of(std::int32_t half) { return half == kNone ? kNone : Surface::next(half); }
    static std::int32_t previous_of(std::int32_t half) {
        return half == kNone ? kNone : Surface::previous(half);
    }
    /// The coded fan at a half-edge's beginning.
    std::int32_t fan_made(std::int32_t half) const {
        return fan_made_[static_cast<std::size_t>(surface_->fan[static_cast<std::size_t>(half)])];
    }

    bool start_piece() {
        std::array<std::int32_t, 3> halves = {kNone, kNone, kNone}, corners{};
        if (surface_) {
            while (is_placed_[next_seed_]) ++next_seed_;
            const auto h = static_cast<std::int32_t>(3 * next_seed_);
            halves = {h, h + 1, h + 2};
        }
        for (std::size_t k = 0; k < 3; ++k) {
            const auto made = code_fan(halves[k], kNone);
            if (!made) return false;
            corners[k] = *made;
        }
        place(corners[0], corners[1], corners[2], halves[0]);
        std::array<std::int32_t, 3> loop{};
        for (std::size_t k = 0; k < 3; ++k)
            loop[k] = add_edge(corners[(k + 1) % 3], corners[(k + 2) % 3], halves[k]);
        for (std::size_t k = 0; k < 3; ++k) link(loop[k], loop[(k + 2) % 3]);
        for (const std::int32_t e : loop) queue(e);
        return true;
    }

    /// A gate at the fans with fewest triangles left, the youngest of equal ones.
    std::optional<std::int32_t> take_gate() {
        for (auto& waiting : queues_) {
            while (!waiting.empty()) {
                const std::int32_t e = waiting.back();
                waiting.pop_back();
                if (edge(e).is_active && !edge(e).is_border) return e;
            }
        }
        return std::nullopt;
    }

    void queue(std::int32_t e) {
        if (edge(e).is_border) return;
        // The way round matters: the front is walked along, and what lies behind closes first.
        const std::size_t left = 2 * clip(fan(edge(e).from).left, kQueues) + clip(fan(to(e)).left, kQueues);
        queues_[std::min<std::size_t>(left, kQueues - 1)].push_back(e);
    }

    /// Places the triangle across a gate, or finds that there is none.
    bool pass(std::int32_t e) {
        const std::int32_t u = edge(e).from, w = to(e), before = edge(e).previous, after = edge(e).next;
        const std::int32_t half = surface_ ? outer_[static_cast<std::size_t>(e)] : kNone;
        const Fan from = fan(u), end = fan(w);
        if (from.left == 0 || end.left == 0) return find_border(e);
        const std::size_t left = 8 * clip(from.left, 7) + clip(end.left, 7);
        if (from.is_open && end.is_open) {
            const std::size_t borders = 4 * from.borders + end.borders;
            if (is_border_.code(coder_, half == kNone, {left, 64 * borders + left, borders}, 0))
                return find_border(e);
        }
        const bool joins_before = code_join(from, half != kNone && front_edge(previous_of(half)) == before);
        const bool joins_after = code_join(end, half != kNone && front_edge(next_of(half)) == after);
        std::int32_t x = kNone, meets = kNone;
        if (joins_before || joins_after) {
            x = joins_before ? edge(before).from : to(after);
            if (joins_before && joins_after && x != to(after)) return false;
            if ((joins_before && edge(before).is_border) || (joins_after && edge(after).is_border))
                return false;
        } else {
            const bool is_new = surface_ && fan_made(previous_of(half)) == kNone;
            const std::size_t open = (from.is_open ? 2u : 0u) + (end.is_open ? 1u : 0u);
            if (is_new_.code(coder_, is_new, {left, 64 * open + left}, open)) {
                const auto made = code_fan(previous_of(half), e);
                if (!made) return false;
                x = *made;
            } else {
                meets = code_meeting(e, half);
                if (meets == kNone) return false;
                x = edge(meets).from;
            }
        }
        if (x == u || x == w || fan(x).left == 0 || is_full()) return false;
        place(u, w, x, half);

        const std::int32_t first = joins_before ? kNone : add_edge(u, w, previous_of(half));  // u to x
        const std::int32_t second = joins_after ? kNone : add_edge(x, u, next_of(half));      // x to w
        edge(e).is_active = false;
        if (joins_before) edge(before).is_active = false;
        if (joins_after) edge(after).is_active = false;
        fan(u).wedges -= joins_before ? 1 : 0;
        fan(w).wedges -= joins_after ? 1 : 0;
        fan(x).wedges += (meets != kNone ? 1 : 0) - (joins_before && joins_after ? 1 : 0);
        if (joins_before && joins_after) {
            if (edge(before).previous != after) link(edge(before).previous, edge(after).next);
        } else if (joins_before) {
            link(edge(before).previous, second);
            link(second, after);
        } else if (joins_after) {
            const std::int32_t beyond = edge(after).next;
            link(before, first);
            link(first, beyond);
        } else {
            const std::int32_t leaves = meets == kNone ? second : meets;
            const std::int32_t arrives = meets == kNone ? first : edge(meets).previous;
            link(before, first);
            link(first, leaves);
            link(arrives, second);
            link(second, after);
        }
        for (const std::int32_t made : {first, second}) {
            if (made == kNone) continue;
            queue(edge(made).previous);
            queue(edge(made).next);
        }
        for (const std::int32_t made : {first, second}) {
            if (made != kNone) queue(made);
        }
        return true;
    }

    /// Whether the triangle across a gate fills one of the front's wedges at an end of it; where the fan
    /// tells, nothing is coded.
    bool code_join(const Fan& end, bool joins) {
        if (!end.is_open && end.left == end.wedges) return true;
        if (end.wedges == 1) return false;
        return code_bit(coder_, joins_[end.is_open ? 1 : 0], joins);
    }

    bool find_border(std::int32_t e) {
        edge(e).is_border = true;
        for (const std::int32_t f : {edge(e).from, to(e)})
            fan(f).borders = std::min<std::uint8_t>(fan(f).borders + 1, 3);
        return true;
    }

    /// half: of the surface, inside the placed triangle along the edge.
    std::int32_t add_edge(std::int32_t from, std::int32_t behind, std::int32_t half) {
        const auto e = static_cast<std::int32_t>(edges_.size());
        edges_.push_back({.from = from, .behind = behind});
        if (surface_) {
            outer_.push_back(twin_of(half));
            if (outer_.back() != kNone) edge_of_half_[static_cast<std::size_t>(outer_.back())] = e;
        }
        return e;
    }

    void place(std::int32_t u, std::int32_t w, std::int32_t x, std::int32_t half) {
        const auto source = static_cast<std::size_t>(half / 3);
        if (surface_) {
            is_placed_[source] = 1;
            coded_.source_triangle.push_back(half / 3);
        }
        was_flipped_ = code_bit(coder_, is_flipped_[was_flipped_ ? 1 : 0],
                                surface_ && surface_->is_flipped[source] != 0);
        for (const std::int32_t f : {u, w, x}) --fan(f).left;
        const std::int32_t a = fan(w).vertex, b = fan(x).vertex;
        coded_.triangles.push_back({fan(u).vertex, was_flipped_ ? b : a, was_flipped_ ? a : b});
    }

    static std::size_t clip(std::int32_t value, std::int32_t largest) {
        return static_cast<std::size_t>(std::clamp(value, 0, largest));
    }
    std::size_t kind(std::int32_t f) {
        if (f == kNone) return 0;
        return fan(f).is_open ? 9 + clip(fan(f).size, 6) : clip(fan(f).size - 2, 8);
    }

    /// A fan that is met for the first time, at the beginning of a half-edge; gate: across which, kNone for a
    /// piece's first triangle.
    std::optional<std::int32_t> code_fan(std::int32_t half, std::int32_t gate) {
        Fan made;
        std::int32_t vertex = kNone, size = 0;
        bool is_open = false;
        if (surface_) {
            vertex = surface_->start(half);
            const auto f = static_cast<std::size_t>(surface_->fan[static_cast<std::size_t>(half)]);
            size = surface_->fan_size[f];
            is_open = surface_->fan_is_open[f] != 0;
            fan_made_[f] = static_cast<std::int32_t>(fans_.size());
        }
        const std::int32_t number = numbers_.of(vertex);
        if (code_bit(coder_, is_again_[was_again_ ? 1 : 0], number != kNone)) {
            was_again_ = true;
            const std::uint64_t age =
                again_age_.code(coder_, static_cast<std::uint64_t>(vertices_ - 1 - number));
            if (age >= static_cast<std::uint64_t>(vertices_)) return std::nullopt;
            made.vertex = vertices_ - 1 - static_cast<std::int32_t>(age);
        } else {
            was_again_ = false;
            if (vertices_ == vertex_count_) return std::nullopt;
            if (surface_) {
                numbers_.set(vertex, vertices_);
                coded_.source_vertex.push_back(vertex);
            }
            made.vertex = vertices_++;
        }

        const std::int32_t u = gate == kNone ? kNone : edge(gate).from, w = gate == kNone ? kNone : to(gate);
        const std::int32_t behind = gate == kNone ? kNone : edge(gate).behind;
        const std::int32_t u_before = gate == kNone ? kNone : edge(edge(gate).previous).from;
        const std::int32_t w_after = gate == kNone ? kNone : to(edge(gate).next);
        const std::size_t ends = kFanKinds * kind(u) + kind(w);
        const std::size_t sides = kFanKinds * kind(u_before) + kind(w_after);
        const std::size_t left = gate == kNone ? 0 : 8 * clip(fan(u).left, 7) + clip(fan(w).left, 7);
        const std::size_t borders = gate == kNone ? 0 : 1 + 4 * fan(u).borders + fan(w).borders;
        made.is_open =
            is_open_.code(coder_, is_open, {ends, 64 * borders + left, sides, was_open_ ? 1u : 0u}, borders);
        was_open_ = made.is_open;

        // The size: whether it is the regular one, whether less, and how far.
        const std::size_t last = kFanKinds * last_kinds_[0] + last_kinds_[1];
        const std::size_t behind_kind = kFanKinds * kind(behind) + last_kinds_[0];
        const auto code = [&](std::size_t node, bool bit) {
            node += made.is_open ? kSizeNodes : 0;
            return size_.code(coder_, bit,
                              {node, 64 * node + left, 256 * node + ends, 256 * node + sides,
                               256 * node + behind_kind, 256 * node + last},
                              node);
        };
        const std::int32_t regular = made.is_open ? 3 : 6;
        made.size = regular;
        if (!code(0, size == regular)) {
            if (code(1, size < regular)) {
                std::size_t node = 2;
                for (--made.size; made.size > 1 && code(node, size < made.size); ++node) --made.size;
            } else {
                std::size_t node = 8;
                for (++made.size; node + 1 < kSizeNodes && code(node, size > made.size); ++node) ++made.size;
                if (node + 1 == kSizeNodes) {
                    const std::uint64_t more =
                        large_size_.code(coder_, static_cast<std::uint64_t>(size - made.size));
                    if (more > static_cast<std::uint64_t>(triangle_count_)) return std::nullopt;
                    made.size = static_cast<std::int32_t>(std::min<std::int64_t>(
                        made.size + static_cast<std::int64_t>(more), triangle_count_ + 1));
                }
            }
        }
        if (made.size > triangle_count_) return std::nullopt;
        made.left = made.size;
        fans_.push_back(made);
        last_kinds_ = {kind(static_cast<std::int32_t>(fans_.size() - 1)), last_kinds_[0]};
        return static_cast<std::int32_t>(fans_.size() - 1);
    }

    /// A third corner that is on the front already: the edge of the front that leaves it where the triangle
    /// comes between.
    std::int32_t code_meeting(std::int32_t gate, std::int32_t half) {
        std::int32_t wanted = surface_ ? find_meeting(half) : kNone;
        // Near: the how manieth fan with triangles left, forward or backward.
        std::array<int, 2> steps = {0, 0};
        if (surface_) {
            for (const bool forward : {true, false}) {
                int count = 0;
                std::int32_t e = gate;
                for (int k = 0; k < kNearSteps; ++k) {
                    if (!step(gate, forward, e)) break;
                    ++count;
                    if (e == wanted) steps[forward ? 1 : 0] = count;
                    if (e == wanted) break;
                }
            }
        }
        const bool is_near = steps[0] + steps[1] > 0;
        if (!code_bit(coder_, meeting_is_near_, is_near)) {
            const auto youngest = static_cast<std::int32_t>(edges_.size()) - 1;
            const std::uint64_t age =
                meeting_age_.code(coder_, static_cast<std::uint64_t>(youngest - wanted));
            if (age > static_cast<std::uint64_t>(youngest)) return kNone;
            const std::int32_t e = youngest - static_cast<std::int32_t>(age);
            return edge(e).is_active && e != gate && e != edge(gate).next ? e : kNone;
        }
        const bool forward =
            code_bit(coder_, meeting_is_forward_, steps[1] > 0 && (steps[0] == 0 || steps[1] < steps[0]));
        const std::uint64_t count =
            meeting_steps_.code(coder_, static_cast<std::uint64_t>(steps[forward ? 1 : 0] - 1));
        if (count >= kNearSteps) return kNone;
        std::int32_t e = gate;
        for (std::uint64_t k = 0; k <= count; ++k) {
            if (!step(gate, forward, e)) return kNone;
        }
        return e;
    }

    /// On to the next edge of the gate's loop that leaves a fan with triangles left, other than the gate's
    /// ends; false at the end. Looks at kNearSteps edges at most.
    bool step(std::int32_t gate, bool forward, std::int32_t& e) {
        if (e == gate && forward) e = edge(gate).next;
        for (int k = 0; k < kNearSteps; ++k) {
            e = forward ? edge(e).next : edge(e).previous;
            if (e == gate || (!forward && e == edge(gate).next)) return false;
            const std::int32_t f = edge(e).from;
            if (f != edge(gate).from && f != to(gate) && fan(f).left > 0) return true;
        }
        return false;
    }

    /// Of the surface: from the triangle on, around its third corner, to the placed triangles.
    std::int32_t find_meeting(std::int32_t half) const {
        // Edges of the front leave the corner along half-edges that leave it, and arrive along those that
        // arrive.
        for (std::int32_t leaves = previous_of(half);;) {
            if (const std::int32_t e = front_edge(leaves); e != kNone) return e;
            const std::int32_t other = twin_of(leaves);
            if (other == kNone) break;
            leaves = next_of(other);
        }
        for (std::int32_t arrives = next_of(half);;) {
            if (const std::int32_t e = front_edge(arrives); e != kNone)
                return edges_[static_cast<std::size_t>(e)].next;
            arrives =
                previous_of(twin_of(arrives));  // the corner's fan has placed triangles: there is a twin
        }
    }
    std::int32_t front_edge(std::int32_t half) const {
        const std::int32_t e = edge_of_half_[static_cast<std::size_t>(half)];
        return e != kNone && edges_[static_cast<std::size_t>(e)].is_active ? e : kNone;
    }

    BitCoder& coder_;
    const Surface* surface_;
    std::int64_t triangle_count_, vertex_count_;
    CodedSurface coded_;

    std::vector<Fan> fans_;
    std::vector<FrontEdge> edges_;
    std::array<std::vector<std::int32_t>, kQueues> queues_;  // by triangles left
    std::int32_t vertices_ = 0;

    // Of encoding alone.
    std::size_t next_seed_ = 0;
    std::vector<std::int32_t> outer_;         // of each edge of the front: half-edge of the triangle across
    std::vector<std::int32_t> edge_of_half_;  // the way back
    std::vector<std::int32_t> fan_made_;
    VertexNumbers numbers_;
    std::vector<std::uint8_t> is_placed_;

    static constexpr std::size_t kSizeNodes = 24;
    bool was_flipped_ = false, was_again_ = false, was_open_ = false;
    std::array<std::size_t, 2> last_kinds_{};
    std::array<AdaptiveBit, 2> is_flipped_, is_again_;
    AdaptiveCount again_age_, large_size_, meeting_age_, meeting_steps_;
    AdaptiveBit meeting_is_near_, meeting_is_forward_;
    std::array<AdaptiveBit, 2> joins_;
    MixedBits is_border_{{64, 16 * 64, 16}, 1};
    MixedBits is_new_{{64, 256}, 4};
    MixedBits is_open_{{256, 17 * 64, 256, 2}, 17};
    MixedBits size_{{2 * kSizeNodes, 64 * 2 * kSizeNodes, 256 * 2 * kSizeNodes, 256 * 2 * kSizeNodes,
                     256 * 2 * kSizeNodes, 256 * 2 * kSizeNodes},
                    2 * kSizeNodes};
};

}  // namespace

CodedSurface encode_surface(BitCoder& coder, const Surface& surface) {
    constexpr std::int64_t kAnyVertexCount = std::numeric_limits<std::int32_t>::max();
    Walk walk(coder, &surface, static_cast<std::int64_t>(surface.triangles.size()), kAnyVertexCount);
    walk.run();
    return walk.take();
}

Expected<CodedSurface> decode_surface(BitCoder& coder, std::int64_t triangle_count,
                                      std::int64_t vertex_count) {
    Walk walk(coder, nullptr, triangle_count, vertex_count);
    if (!walk.run()) return fail(ErrorCode::kCorrupt, "the coded surface is none");
    return walk.take();
}

}  // namespace batchenc
