#include "kernels/order_coder.h"

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "kernels/surface.h"

namespace batchenc {
namespace {

constexpr std::int32_t kNone = -1;

/// Items 0 … n - 1 of which some are there; how many are before one, and which is the k-th, in log n.
class RankedSet {
 public:
    RankedSet(std::size_t size, bool is_full)
        : sums_(size + 1, 0), count_(is_full ? static_cast<std::int32_t>(size) : 0) {
        if (!is_full) return;
        for (std::size_t i = 1; i <= size; ++i) sums_[i] = static_cast<std::int32_t>(i & (~i + 1));
    }
    std::int32_t count() const { return count_; }
    void add(std::int32_t item, std::int32_t change) {
        count_ += change;
        for (auto i = static_cast<std::size_t>(item) + 1; i < sums_.size(); i += i & (~i + 1))
            sums_[i] += change;
    }
    /// Members below an item.
    std::int32_t rank(std::int32_t item) const {
        std::int32_t sum = 0;
        for (auto i = static_cast<std::size_t>(item); i > 0; i -= i & (~i + 1)) sum += sums_[i];
        return sum;
    }
    /// The member of a rank below count().
    std::int32_t member(std::int32_t rank) const {
        std::size_t at = 0, step = 1;
        while (2 * step < sums_.size()) step *= 2;
        for (; step > 0; step /= 2) {
            if (at + step < sums_.size() && sums_[at + step] <= rank) {
                at += step;
                rank -= sums_[at];
            }
        }
        return static_cast<std::int32_t>(at);
    }

 private:
    std::vector<std::int32_t> sums_;  // Fenwick
    std::int32_t count_;
};

/// Signed differences.
class AdaptiveDifference {
 public:
    std::int64_t code(BitCoder& coder, std::int64_t value) {
        const std::uint64_t size = size_.code(coder, static_cast<std::uint64_t>(value < 0 ? -value : value));
        if (size == 0) return 0;
        const bool is_negative = code_bit(coder, sign_[was_negative_ ? 1 : 0], value < 0);
        was_negative_ = is_negative;
        return is_negative ? -static_cast<std::int64_t>(size) : static_cast<std::int64_t>(size);
    }

 private:
    AdaptiveCount size_;
    std::array<AdaptiveBit, 2> sign_;
    bool was_negative_ = false;
};

/// Which of the items that are left comes next, where no neighbour of the last one does: by its rank on the
/// front, in the order in which items came there, or by its rank among all.
class Jumps {
 public:
    explicit Jumps(std::size_t size)
        : front_(size, false), rest_(size, true), place_(size, kNone), item_(size, kNone) {}

    void visit(std::int32_t item) {
        rest_.add(item, -1);
        last_ = item;
        const std::int32_t place = place_[static_cast<std::size_t>(item)];
        if (place != kNone) front_.add(place, -1);
        place_[static_cast<std::size_t>(item)] = kVisited;
    }
    bool is_visited(std::int32_t item) const { return place_[static_cast<std::size_t>(item)] == kVisited; }
    /// A neighbour of one that was visited.
    void meet(std::int32_t item) {
        std::int32_t& place = place_[static_cast<std::size_t>(item)];
        if (place != kNone) return;
        place = next_place_++;
        item_[static_cast<std::size_t>(place)] = item;
        front_.add(place, 1);
    }
    /// kNone where the stream is corrupt.
    std::int32_t code(BitCoder& coder, std::int32_t item) {
        bool on_front = item != kNone && place_[static_cast<std::size_t>(item)] != kNone;
        if (front_.count() == 0)
            on_front = false;
        else if (front_.count() == rest_.count())
            on_front = true;
        else
            on_front = code_bit(coder, on_front_[was_on_front_ ? 1 : 0], on_front);
        was_on_front_ = on_front;
        RankedSet& set = on_front ? front_ : rest_;
        const std::int32_t guess = on_front ? cursor_ : rest_.rank(last_);
        std::int64_t rank = 0;
        if (item != kNone) rank = set.rank(on_front ? place_[static_cast<std::size_t>(item)] : item);
        rank = guess + (on_front ? front_step_ : rest_step_).code(coder, rank - guess);
        if (rank < 0 || rank >= set.count()) return kNone;
        const std::int32_t member = set.member(static_cast<std::int32_t>(rank));
        if (!on_front) return member;
        cursor_ = static_cast<std::int32_t>(rank);
        return item_[static_cast<std::size_t>(member)];
    }

 private:
    static constexpr std::int32_t kVisited = -2;
    RankedSet front_, rest_;
    std::vector<std::int32_t>
        place_;  // of each item on the front; kVisited, or kNone where it has not been met
    std::vector<std::int32_t> item_;  // at each place
    std::int32_t next_place_ = 0, cursor_ = 0, last_ = 0;
    bool was_on_front_ = false;
    std::array<AdaptiveBit, 2> on_front_;
    AdaptiveDifference front_step_, rest_step_;
};

class OrderWalk {
 public:
    OrderWalk(BitCoder& coder, const CodedSurface& coded, std::int64_t vertex_count)
        : coder_(coder),
          coded_(coded),
          vertex_count_(vertex_count),
          surface_(Surface::of(coded.triangles)),
          first_corner_(coded.triangles.size(), 0) {
        std::int32_t largest = kNone;
        for (const Triangle& t : coded.triangles) largest = std::max({largest, t[0], t[1], t[2]});
        vertices_ = static_cast<std::size_t>(largest + 1);
    }

    /// wanted: encoding, the coded number and first corner of each triangle of the file.
    bool run_triangles(std::span<const std::pair<std::int32_t, int>> wanted) {
        const std::size_t count = coded_.triangles.size();
        Jumps jumps(count);
        std::size_t last_slot = kJump, slot_before = kJump;
        std::int32_t last = kNone;
        appearance_.assign(vertices_, kNone);
        for (std::size_t i = 0; i < count; ++i) {
            const std::int32_t target = wanted.empty() ? kNone : wanted[i].first;
            std::size_t slot = kJump;
            std::int32_t found = kNone;
            if (last != kNone) {
                list_neighbours(last, jumps);
                const bool is_near = std::any_of(neighbours_.begin(), neighbours_.end(),
                                                 [&](const auto& n) { return n.first == target; });
                const std::size_t left = std::min<std::size_t>(neighbours_.size(), 7);
                if (!neighbours_.empty()) {
                    const bool near = is_near_.code(
                        coder_, is_near,
                        {history_ & 63, 8 * last_slot + left, kSlots * last_slot + slot_before}, 0);
                    history_ = 2 * history_ + (near ? 1 : 0);
                    if (!near) neighbours_.clear();
                }
                for (const auto& [candidate, place] : neighbours_) {
                    if (&candidate == &neighbours_.back().first) {
                        found = candidate;
                        slot = place;
                        break;
                    }
                    int seen = 0, done = 0;
                    for (const std::int32_t v : coded_.triangles[static_cast<std::size_t>(candidate)])
                        seen += appearance_[static_cast<std::size_t>(v)] != kNone ? 1 : 0;
                    for (std::int32_t h = 3 * candidate; h < 3 * candidate + 3; ++h) {
                        const std::int32_t other = surface_.twin[static_cast<std::size_t>(h)];
                        done += other == kNone || jumps.is_visited(other / 3) ? 1 : 0;
                    }
                    const auto shape = static_cast<std::size_t>(4 * seen + done);
                    if (is_next_triangle_.code(
                            coder_, candidate == target,
                            {place, kSlots * place + last_slot,
                             kSlots * (kSlots * place + last_slot) + slot_before, 16 * place + shape,
                             16 * (kSlots * place + last_slot) + shape},
                            place)) {
                        found = candidate;
                        slot = place;
                        break;
                    }
                }
            }
            if (found == kNone) found = jumps.code(coder_, target);
            if (found == kNone || coder_.is_overrun()) return false;
            jumps.visit(found);
            for (std::int32_t h = 3 * found; h < 3 * found + 3; ++h) {
                const std::int32_t other = surface_.twin[static_cast<std::size_t>(h)];
                if (other != kNone && !jumps.is_visited(other / 3)) jumps.meet(other / 3);
            }
            code_rotation(found, wanted.empty() ? 0 : wanted[i].second, last, slot);
            slot_before = last_slot;
            last_slot = slot;
            last = found;
            order_.push_back(found);
        }
        return true;
    }

    /// wanted: encoding, the vertex numbers in the order of their indices. indices: encoding, of each number.
    bool run_vertices(std::span<const std::int32_t> wanted, std::span<const std::int32_t> wanted_index) {
        // Vertices by their first appearance in the file's triangles.
        std::vector<std::int32_t> by_appearance(vertices_);
        for (std::size_t v = 0; v < vertices_; ++v)
            by_appearance[static_cast<std::size_t>(appearance_[v])] = static_cast<std::int32_t>(v);
        index_.assign(vertices_, 0);
        Jumps jumps(vertices_);  // over appearances
        std::vector<std::int32_t> half_of(vertices_, kNone);
        for (std::size_t h = 0; h < surface_.twin.size(); ++h) {
            std::int32_t& some =
                half_of[static_cast<std::size_t>(surface_.start(static_cast<std::int32_t>(h)))];
            // An open fan is walked from its beginning.
            if (some == kNone || surface_.twin[h] == kNone) some = static_cast<std::int32_t>(h);
        }
        std::int32_t last = kNone, before = kNone, lowest = 0;
        std::size_t last_slot = 0, slot_before = 0;
        std::int64_t next_index = 0;
        for (std::size_t i = 0; i < vertices_; ++i) {
            const std::int32_t target = wanted.empty() ? kNone : wanted[i];
            const std::uint64_t gap = gap_.code(
                coder_, target == kNone ? 0
                                        : static_cast<std::uint64_t>(
                                              wanted_index[static_cast<std::size_t>(target)] - next_index));
            next_index += static_cast<std::int64_t>(gap);
            if (static_cast<std::int64_t>(gap) >= vertex_count_ || next_index >= vertex_count_ ||
                coder_.is_overrun())
                return false;
            std::size_t slot = 0;
            std::int32_t found = kNone;
            while (jumps.is_visited(lowest)) ++lowest;
            const auto ask = [&](std::int32_t candidate, std::size_t place, std::size_t shape) {
                if (!is_next_vertex_.code(
                        coder_, candidate == target,
                        {place, kRing * place + last_slot, kRing * (kRing * place + last_slot) + slot_before,
                         4 * (kRing * place + last_slot) + shape},
                        place))
                    return false;
                found = candidate;
                slot = place;
                return true;
            };
            const std::int32_t first = by_appearance[static_cast<std::size_t>(lowest)];
            if (!ask(first, 1, 0) && last != kNone) {
                const std::int32_t follows = appearance_[static_cast<std::size_t>(last)] + 1;
                std::int32_t second = kNone;
                if (follows > lowest && static_cast<std::size_t>(follows) < vertices_ &&
                    !jumps.is_visited(follows))
                    second = by_appearance[static_cast<std::size_t>(follows)];
                if (second == kNone || !ask(second, 2, 0)) {
                    list_ring(last, before, half_of);
                    for (std::size_t k = 0; k < ring_.size() && found == kNone; ++k) {
                        const std::int32_t v = ring_[k];
                        if (is_done(jumps, v) || v == first || v == second) continue;
                        const std::size_t shape =
                            (is_done(jumps, ring_[(k + 1) % ring_.size()]) ? 1u : 0u) +
                            (is_done(jumps, ring_[(k + ring_.size() - 1) % ring_.size()]) ? 2u : 0u);
                        ask(v, 3 + (ring_is_aligned_ ? 12u : 0u) + std::min<std::size_t>(k, 11), shape);
                    }
                }
            }
            if (found == kNone) {
                const std::int32_t at = jumps.code(
                    coder_, target == kNone ? kNone : appearance_[static_cast<std::size_t>(target)]);
                if (at == kNone) return false;
                found = by_appearance[static_cast<std::size_t>(at)];
            }
            jumps.visit(appearance_[static_cast<std::size_t>(found)]);
            list_ring(found, kNone, half_of);
            for (const std::int32_t v : ring_) {
                if (!is_done(jumps, v)) jumps.meet(appearance_[static_cast<std::size_t>(v)]);
            }
            index_[static_cast<std::size_t>(found)] = static_cast<std::int32_t>(next_index++);
            before = last;
            last = found;
            slot_before = last_slot;
            last_slot = slot;
        }
        return true;
    }

    std::vector<Triangle> triangles() const {
        std::vector<Triangle> result;
        result.reserve(order_.size());
        for (const std::int32_t t : order_) {
            Triangle corners;
            for (std::size_t k = 0; k < 3; ++k) corners[k] = index_[static_cast<std::size_t>(corner(t, k))];
            result.push_back(corners);
        }
        return result;
    }

 private:
    static constexpr std::size_t kSteps = 5;               // around a corner of the last triangle
    static constexpr std::size_t kSlots = 4 + 3 * kSteps;  // jump, edges, corners
    static constexpr std::size_t kJump = 0;
    static constexpr std::size_t kRing = 3 + 24;

    bool is_done(const Jumps& jumps, std::int32_t v) const {
        return jumps.is_visited(appearance_[static_cast<std::size_t>(v)]);
    }

    std::int32_t corner(std::int32_t t, std::size_t k) const {
        return coded_
            .triangles[static_cast<std::size_t>(t)][(k + first_corner_[static_cast<std::size_t>(t)]) % 3];
    }
    /// The half-edge of the surface that leaves a corner (of the file's counting).
    std::int32_t half_at(std::int32_t t, std::size_t k) const {
        std::size_t c = (k + first_corner_[static_cast<std::size_t>(t)]) % 3;
        if (surface_.is_flipped[static_cast<std::size_t>(t)]) c = (3 - c) % 3;
        return 3 * t + static_cast<std::int32_t>(c);
    }

    void list_neighbours(std::int32_t t, const Jumps& jumps) {
        neighbours_.clear();
        const auto add = [&](std::int32_t half, std::size_t slot) {
            if (half == kNone || half / 3 == t || jumps.is_visited(half / 3)) return;
            for (const auto& known : neighbours_) {
                if (known.first == half / 3) return;
            }
            neighbours_.emplace_back(half / 3, slot);
        };
        for (std::size_t k = 0; k < 3; ++k)
            add(surface_.twin[static_cast<std::size_t>(half_at(t, k))], 1 + k);
        for (std::size_t k = 0; k < 3; ++k) {
            std::int32_t h = half_at(t, k);
            for (std::size_t step = 0; step < kSteps; ++step) {
                h = surface_.twin[static_cast<std::size_t>(Surface::previous(h))];
                if (h == kNone || h / 3 == t) break;
                if (step > 0) add(h, 4 + kSteps * k + step);
            }
        }
    }

    void code_rotation(std::int32_t t, int wanted, std::int32_t last, std::size_t slot) {
        // Corners by when their vertices appeared.
        const Triangle& corners = coded_.triangles[static_cast<std::size_t>(t)];
        std::array<std::int32_t, 3> age;
        for (std::size_t k = 0; k < 3; ++k) {
            age[k] = appearance_[static_cast<std::size_t>(corners[k])];
            if (age[k] == kNone) age[k] = appeared_;
        }
        const auto oldest = static_cast<std::size_t>(std::min_element(age.begin(), age.end()) - age.begin());
        const auto youngest =
            static_cast<std::size_t>(std::max_element(age.begin(), age.end()) - age.begin());
        std::size_t facing = 0;
        if (slot >= 1 && slot <= 3) {
            const std::int32_t half = surface_.twin[static_cast<std::size_t>(half_at(last, slot - 1))];
            facing = static_cast<std::size_t>(half % 3);
            if (surface_.is_flipped[static_cast<std::size_t>(t)])
                facing = (5 - facing) % 3;  // beginning as wound in the file
        } else {
            facing = oldest;
        }
        const std::size_t shape = 3 * ((youngest + 3 - facing) % 3) + (oldest + 3 - facing) % 3;
        std::size_t turn = (static_cast<std::size_t>(wanted) + 3 - facing) % 3;
        const auto ask = [&](std::size_t node, bool bit) {
            return rotation_.code(coder_, bit,
                                  {2 * slot + node, 2 * (9 * slot + shape) + node,
                                   2 * (3 * slot + last_turn_) + node, 2 * (9 * last_turn_ + shape) + node},
                                  node);
        };
        if (!ask(0, turn == 0))
            turn = ask(1, turn == 1) ? 1 : 2;
        else
            turn = 0;
        last_turn_ = turn;
        first_corner_[static_cast<std::size_t>(t)] = static_cast<std::uint8_t>((turn + facing) % 3);
        for (std::size_t k = 0; k < 3; ++k) {
            std::int32_t& appearance = appearance_[static_cast<std::size_t>(corner(t, k))];
            if (appearance == kNone) appearance = appeared_++;
        }
    }

    void list_ring(std::int32_t v, std::int32_t from, const std::vector<std::int32_t>& half_of) {
        ring_.clear();
        const std::int32_t start = half_of[static_cast<std::size_t>(v)];
        std::int32_t h = start;
        do {
            ring_.push_back(surface_.start(Surface::next(h)));
            const std::int32_t back = Surface::previous(h);
            h = surface_.twin[static_cast<std::size_t>(back)];
            if (h == kNone) ring_.push_back(surface_.start(back));
        } while (h != kNone && h != start && ring_.size() < 64);
        const auto at = from == kNone ? ring_.end() : std::find(ring_.begin(), ring_.end(), from);
        ring_is_aligned_ = at != ring_.end();
        if (ring_is_aligned_) std::rotate(ring_.begin(), at, ring_.end());
    }

    BitCoder& coder_;
    const CodedSurface& coded_;
    std::int64_t vertex_count_;
    Surface surface_;
    std::size_t vertices_ = 0;
    std::vector<std::uint8_t> first_corner_;
    std::vector<std::int32_t> order_, appearance_, index_;
    std::int32_t appeared_ = 0;
    std::size_t last_turn_ = 0;
    std::vector<std::pair<std::int32_t, std::size_t>> neighbours_;
    std::vector<std::int32_t> ring_;
    bool ring_is_aligned_ = false;

    std::size_t history_ = 0;
    MixedBits is_near_{{64, 8 * kSlots, kSlots* kSlots}, 1};
    MixedBits is_next_triangle_{
        {kSlots, kSlots* kSlots, kSlots* kSlots* kSlots, 16 * kSlots, 16 * kSlots* kSlots}, kSlots};
    MixedBits rotation_{{2 * kSlots, 18 * kSlots, 6 * kSlots, 54}, 2};
    MixedBits is_next_vertex_{{kRing, kRing* kRing, kRing* kRing* kRing, 4 * kRing* kRing}, kRing};
    AdaptiveCount gap_;
};

}  // namespace

void encode_order(BitCoder& coder, const CodedSurface& coded, std::span<const Triangle> triangles,
                  std::int64_t vertex_count) {
    std::vector<std::pair<std::int32_t, int>> wanted(triangles.size());
    for (std::size_t k = 0; k < triangles.size(); ++k) {
        const auto source = static_cast<std::size_t>(coded.source_triangle[k]);
        int first = 0;
        for (int r = 0; r < 3; ++r) {
            bool same = true;
            for (std::size_t c = 0; c < 3; ++c)
                same = same && coded.source_vertex[static_cast<std::size_t>(
                                   coded.triangles[k][(c + static_cast<std::size_t>(r)) % 3])] ==
                                   triangles[source][c];
            if (same) first = r;
        }
        wanted[source] = {static_cast<std::int32_t>(k), first};
    }
    std::vector<std::int32_t> vertices(coded.source_vertex.size());
    for (std::size_t v = 0; v < vertices.size(); ++v) vertices[v] = static_cast<std::int32_t>(v);
    std::sort(vertices.begin(), vertices.end(), [&](std::int32_t a, std::int32_t b) {
        return coded.source_vertex[static_cast<std::size_t>(a)] <
               coded.source_vertex[static_cast<std::size_t>(b)];
    });
    OrderWalk walk(coder, coded, vertex_count);
    walk.run_triangles(wanted);
    walk.run_vertices(vertices, coded.source_vertex);
}

Expected<std::vector<Triangle>> decode_order(BitCoder& coder, const CodedSurface& coded,
                                             std::int64_t vertex_count) {
    OrderWalk walk(coder, coded, vertex_count);
    if (!walk.run_triangles({}) || !walk.run_vertices({}, {}))
        return fail(ErrorCode::kCorrupt, "the coded order is none");
    return walk.triangles();
}

}  // namespace batchenc
