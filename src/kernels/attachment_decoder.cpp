#include "kernels/attachment_decoder.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdlib>
#include <limits>
#include <new>
#include <string>

#include "kernels/range_coder.h"

// Triangles stand one by one in file order. Each is attached to what is already coded where it can be: by
// an open edge ("gate") it costs a symbol for the gate and one for the third vertex. An index that nothing
// predicts is coded as its distance from a guess. Everything that both sides predict from stands in State,
// which only triangles already coded change; State::add is the one place where it moves on.

namespace batchenc {
namespace {

constexpr std::int32_t kNone = -1;
constexpr std::int64_t kMostVertices = std::numeric_limits<std::int32_t>::max();

// A directed edge p -> q that some coded triangle has the other way round and no triangle yet this way: a
// consistently wound neighbour is (p, q, third), from one of its corners on.
struct Gate {
    std::int32_t p = kNone, q = kNone;
    friend bool operator==(const Gate&, const Gate&) = default;
};

// Symbols for how a triangle is attached, and at which of its corners the gate begins.
constexpr int kRecentGates = 9;
constexpr int kAnchored =
    0;  // + corner: that corner's index follows, and the gate is the open edge that leaves it
constexpr int kFree = 3;    // no gate: three indices follow
constexpr int kRecent = 4;  // + 3 * age + corner: one of the gates opened last
constexpr int kAttachments = kRecent + 3 * kRecentGates;

// Symbols for the third vertex of a gate.
constexpr int kNext = 0;   // the smallest index above all used so far
constexpr int kRight = 1;  // the end of the open edge that leaves q
constexpr int kLeft = 2;   // the start of the open edge that arrives at p
constexpr int kOther = 3;  // a distance from a guess follows
constexpr int kThirds = 4;
constexpr int kNoThird = kThirds;  // context only: the triangle was free

// Symbols from integers of small magnitude: 0, -1, 1, -2, 2, ...
int unfold(std::int32_t value, int symbol_count) {  // kNone where it is no symbol
    if (value < -symbol_count || value > symbol_count) return kNone;
    const int symbol = value < 0 ? -2 * value - 1 : 2 * value;
    return symbol < symbol_count ? symbol : kNone;
}

// Gates by vertex: a direct-mapped cache, so that memory is bounded by what the counts justify and a look-up
// is one line of cache. A collision, or a second open edge at a vertex, loses a prediction and never a
// triangle.
class OpenEdges {
 public:
    OpenEdges(std::int64_t triangle_count, std::int64_t vertex_count) {
        constexpr std::int64_t kMostSlots = 1 << 22;
        const std::int64_t useful = std::min({vertex_count, 3 * triangle_count, kMostSlots});
        slots_.resize(std::bit_ceil(static_cast<std::size_t>(std::max<std::int64_t>(useful, 1))));
        mask_ = static_cast<std::uint32_t>(slots_.size() - 1);
    }

    // End of the open edge that leaves v, or kNone.
    std::int32_t after(std::int32_t v) const { return find(v).after; }
    // Start of the open edge that arrives at v, or kNone.
    std::int32_t before(std::int32_t v) const { return find(v).before; }
    // Third vertex of the triangle behind the edge that was opened last at v; 0 where unknown.
    std::int32_t opposite(std::int32_t v) const { return find(v).opposite; }
    // Triangles met at v.
    std::int32_t valence(std::int32_t v) const { return find(v).valence; }

    void count(std::int32_t v) { ++claim(v).valence; }
    void open(const Gate& gate, std::int32_t opposite) {
        Slot& start = claim(gate.p);
        start.after = gate.q;
        start.opposite = opposite;
        claim(gate.q).before = gate.p;
    }
    // True if the edge was open.
    bool close(const Gate& gate) {
        Slot& start = slots_[index(gate.p)];
        const bool leaves = start.vertex == gate.p && start.after == gate.q;
        if (leaves) start.after = kNone;
        Slot& end = slots_[index(gate.q)];
        const bool arrives = end.vertex == gate.q && end.before == gate.p;
        if (arrives) end.before = kNone;
        return leaves || arrives;
    }

 private:
    struct Slot {
        std::int32_t vertex = kNone, before = kNone, after = kNone, opposite = 0, valence = 0;
    };
    std::size_t index(std::int32_t v) const { return static_cast<std::uint32_t>(v) & mask_; }
    const Slot& find(std::int32_t v) const {
        static constexpr Slot kUnknown{};
        const Slot& slot = slots_[index(v)];
        return slot.vertex == v ? slot : kUnknown;
    }
    Slot& claim(std::int32_t v) {
        Slot& slot = slots_[index(v)];
        if (slot.vertex != v) slot = Slot{.vertex = v};
        return slot;
    }

    std::vector<Slot> slots_;
    std::uint32_t mask_ = 0;
};

// Distances of indices from a guess: of several candidates the one that has lately been nearest, with
// statistics of its own, because a regular stretch of a file makes one candidate right again and again.
template <std::size_t kCount>
class GuessedIndex {
 public:
    using Candidates = std::array<std::int32_t, kCount>;

    std::int32_t guess(const Candidates& candidates) const { return candidates[best_]; }
    IntegerModel& model() { return models_[best_]; }
    void learn(const Candidates& candidates, std::int32_t vertex) {
        for (std::size_t i = 0; i < kCount; ++i) {
            const auto distance = static_cast<std::uint32_t>(std::abs(vertex - candidates[i]));
            cost_[i] += 16 * static_cast<std::int32_t>(std::bit_width(distance)) - cost_[i] / 16;
        }
        best_ = static_cast<std::size_t>(std::min_element(cost_.begin(), cost_.end()) - cost_.begin());
    }

 private:
    std::array<std::int32_t, kCount> cost_{};  // decaying sum of the distances' bit lengths
    std::size_t best_ = 0;
    std::array<IntegerModel, kCount> models_;
};

// What both sides know before a triangle, and the statistics of each kind of symbol.
class State {
 public:
    using FreeCandidates = GuessedIndex<5>::Candidates;
    using ThirdCandidates = GuessedIndex<6>::Candidates;

    State(std::int64_t triangle_count, std::int64_t vertex_count)
        : last_vertex_(static_cast<std::int32_t>(vertex_count - 1)),
          edges_(triangle_count, vertex_count),
          attachment_models_(kAttachmentClasses * (kThirds + 1)),
          third_models_(4 * kValences) {}

    IntegerModel& attachment_model() { return attachment_models_[attachment_context_]; }
    int recent_gate_count() const { return gate_count_; }
    const Gate& recent_gate(int age) const { return recent_[static_cast<std::size_t>(age)]; }
    // The gate that leaves v; its q is kNone where none does.
    Gate gate_from(std::int32_t v) const { return {v, edges_.after(v)}; }
    // A vertex with many triangles is about to be closed, so its valence tells right from left and new.
    IntegerModel& third_model(const Gate& gate) {
        const int valence = std::min(edges_.valence(gate.q), kValences - 1);
        const int right = edges_.after(gate.q) != kNone, left = edges_.before(gate.p) != kNone;
        return third_models_[static_cast<std::size_t>(4 * valence + 2 * right + left)];
    }
    // The vertex that a symbol below kOther stands for; kNone where there is none.
    std::int32_t predicted_third(const Gate& gate, int third) const {
        switch (third) {
            case kNext:
                return next_ <= last_vertex_ ? static_cast<std::int32_t>(next_) : kNone;
            case kRight:
                return edges_.after(gate.q);
            default:
                return edges_.before(gate.p);
        }
    }
    ThirdCandidates third_candidates(const Gate& gate) const {
        // Index arithmetic follows the rows of grids: the fourth corner of the parallelogram behind the gate.
        const std::int64_t fourth = std::int64_t{gate.p} + gate.q - edges_.opposite(gate.p);
        return {gate.q, gate.p, previous_third_, next_or_last(), previous_other_, clamped(fourth)};
    }
    // For the corner of a free triangle whose corners before are known, and for the anchor (corner 0).
    FreeCandidates free_candidates(std::size_t corner, const Triangle& t) const {
        const bool first = corner == 0;
        return {previous_[corner], first ? previous_[2] : t[corner - 1], next_or_last(),
                first ? previous_[1] : t[0], previous_free_[corner]};
    }
    GuessedIndex<6>& third_index() { return third_index_; }
    GuessedIndex<5>& free_index(std::size_t corner) { return free_index_[corner]; }
    GuessedIndex<5>& anchor_index() { return anchor_index_; }
    IntegerModel& far_high_model() { return far_high_; }
    IntegerModel& far_low_model() { return far_low_; }

    // Moves on past triangle t. corner: where its gate begins; 0 for a free one.
    void add(const Triangle& t, int attachment, std::size_t corner, int third) {
        const std::int32_t p = t[corner], q = t[(corner + 1) % 3], c = t[(corner + 2) % 3];
        for (const std::int32_t v : t) {
            edges_.count(v);
            next_ = std::max(next_, std::int64_t{v} + 1);
        }
        close_or_open({p, q}, c);
        close_or_open({c, p}, q);
        close_or_open({q, c}, p);
        previous_ = t;
        previous_third_ = c;
        if (attachment == kFree) previous_free_ = t;
        if (third == kOther) previous_other_ = c;
        attachment_context_ = static_cast<std::size_t>(attachment_class(attachment) * (kThirds + 1) + third);
    }

 private:
    static constexpr int kAttachmentClasses = 5;
    static constexpr int kValences = 8;

    static int attachment_class(int attachment) {
        if (attachment < kFree) return 0;
        if (attachment == kFree) return 1;
        return 2 + std::min((attachment - kRecent) / 3, 2);
    }
    std::int32_t clamped(std::int64_t v) const {
        return static_cast<std::int32_t>(std::clamp<std::int64_t>(v, 0, last_vertex_));
    }
    std::int32_t next_or_last() const { return clamped(next_); }
    void close_or_open(const Gate& edge, std::int32_t opposite) {
        const auto end = recent_.begin() + gate_count_;
        if (edges_.close(edge)) {
            const auto at = std::find(recent_.begin(), end, edge);
            if (at == end) return;
            std::move(at + 1, end, at);
            --gate_count_;
        } else {
            const Gate gate{edge.q, edge.p};
            edges_.open(gate, opposite);
            gate_count_ = std::min(gate_count_ + 1, kRecentGates);
            std::move_backward(recent_.begin(), recent_.end() - 1, recent_.end());
            recent_.front() = gate;
        }
    }

    std::int32_t last_vertex_;
    std::int64_t next_ = 0;
    OpenEdges edges_;
    std::array<Gate, kRecentGates> recent_{};  // the youngest first
    int gate_count_ = 0;
    Triangle previous_{}, previous_free_{};
    std::int32_t previous_third_ = 0, previous_other_ = 0;

    std::size_t attachment_context_ = 0;
    std::vector<IntegerModel> attachment_models_, third_models_;
    GuessedIndex<6> third_index_;
    GuessedIndex<5> anchor_index_;
    std::array<GuessedIndex<5>, 3> free_index_;
    IntegerModel far_high_, far_low_;
};

// Distances: d >= 0 is d + 1, d < 0 itself, and 0 announces one beyond kNear in two parts, because the
// integer coder spends 32 plain bits on what 16 do not hold.
constexpr std::int32_t kNear = 32767;
constexpr int kLowBits = 15;

// kNone where the stream leads outside [0, vertex_count).
template <std::size_t kCount>
std::int32_t decode_index(RangeDecoder& coder, State& state, GuessedIndex<kCount>& index,
                          const typename GuessedIndex<kCount>::Candidates& candidates,
                          std::int64_t vertex_count) {
    std::int64_t distance = coder.decode(index.model());
    if (distance > 0) {
        --distance;
    } else if (distance == 0) {
        const std::int64_t high = coder.decode(state.far_high_model());
        distance = high * (1 << kLowBits) + coder.decode(state.far_low_model());
    }
    const std::int64_t v = index.guess(candidates) + distance;
    if (v < 0 || v >= vertex_count) return kNone;
    index.learn(candidates, static_cast<std::int32_t>(v));
    return static_cast<std::int32_t>(v);
}

// False where the stream asks for what does not exist.
bool decode_triangle(RangeDecoder& coder, State& state, std::int64_t vertex_count, Triangle& t) {
    const int attachment = unfold(coder.decode(state.attachment_model()), kAttachments);
    if (attachment == kNone) return false;
    if (attachment == kFree) {
        for (std::size_t corner = 0; corner < 3; ++corner) {
            t[corner] = decode_index(coder, state, state.free_index(corner), state.free_candidates(corner, t),
                                     vertex_count);
            if (t[corner] == kNone) return false;
        }
        state.add(t, attachment, 0, kNoThird);
        return true;
    }
    Gate gate;
    std::size_t corner;
    if (attachment < kFree) {
        corner = static_cast<std::size_t>(attachment - kAnchored);
        const std::int32_t p =
            decode_index(coder, state, state.anchor_index(), state.free_candidates(0, t), vertex_count);
        if (p == kNone) return false;
        gate = state.gate_from(p);
        if (gate.q == kNone) return false;
    } else {
        corner = static_cast<std::size_t>((attachment - kRecent) % 3);
        const int age = (attachment - kRecent) / 3;
        if (age >= state.recent_gate_count()) return false;
        gate = state.recent_gate(age);
    }
    const int third = unfold(coder.decode(state.third_model(gate)), kThirds);
    if (third == kNone) return false;
    const std::int32_t v = third == kOther ? decode_index(coder, state, state.third_index(),
                                                          state.third_candidates(gate), vertex_count)
                                           : state.predicted_third(gate, third);
    if (v == kNone) return false;
    t[corner] = gate.p;
    t[(corner + 1) % 3] = gate.q;
    t[(corner + 2) % 3] = v;
    state.add(t, attachment, corner, third);
    return true;
}

}  // namespace

Expected<std::vector<Triangle>> decode_attachments(std::span<const std::uint8_t> bytes,
                                                   std::int64_t triangle_count, std::int64_t vertex_count) {
    if (vertex_count < 0 || vertex_count > kMostVertices) {
        return fail(ErrorCode::kCorrupt, "a vertex count of " + std::to_string(vertex_count));
    }
    // A triangle has two symbols at least; an empty mesh has no bytes at all.
    if (triangle_count < 0 ||
        static_cast<std::uint64_t>(triangle_count) > max_symbol_count(bytes.size()) / 2) {
        return fail(ErrorCode::kCorrupt, std::to_string(bytes.size()) + " bytes cannot hold " +
                                             std::to_string(triangle_count) + " triangles");
    }
    if (triangle_count == 0) {
        if (!bytes.empty()) return fail(ErrorCode::kCorrupt, "bytes for no triangles");
        return std::vector<Triangle>{};
    }
    auto coder = RangeDecoder::open(bytes);
    if (!coder) return tl::unexpected(std::move(coder.error()));
    try {
        std::vector<Triangle> triangles(static_cast<std::size_t>(triangle_count));
        State state(triangle_count, vertex_count);
        for (std::size_t i = 0; i < triangles.size(); ++i) {
            if (!decode_triangle(*coder, state, vertex_count, triangles[i])) {
                return fail(ErrorCode::kCorrupt, "triangle " + std::to_string(i) +
                                                     " has an index out of range or "
                                                     "is attached to an edge that is not open");
            }
        }
        if (auto finished = coder->finish(); !finished) return tl::unexpected(std::move(finished.error()));
        return triangles;
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::kOutOfMemory,
                    "no memory for " + std::to_string(triangle_count) + " triangles");
    }
}

}  // namespace batchenc
