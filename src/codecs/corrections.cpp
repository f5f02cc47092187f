#include "codecs/corrections.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "kernels/bit_coder.h"
#include "kernels/byte_stream.h"
#include "kernels/mixed_integers.h"

namespace batchenc {
namespace {

using Offset = std::array<std::int32_t, 3>;

constexpr std::int32_t kLargestOffset = 1 << 24;

/// Cells of a lattice of this step reach no farther than the bound from their centre, and a little less, for
/// float32's rounding.
double exact_step(double bound) { return bound * 1.1547005383792515 * (1.0 - 0x1p-9); }
float step_of(double bound) { return static_cast<float>(exact_step(bound)); }

void move(float* place, const BodyMotion& motion, const Offset& offset, float step) {
    std::array<float, 3> local;
    for (std::size_t k = 0; k < 3; ++k) local[k] = static_cast<float>(offset[k]) * step;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const double* turn = motion.rotation.data() + 3 * axis;
        place[axis] += static_cast<float>(turn[0]) * local[0] + static_cast<float>(turn[1]) * local[1] +
                       static_cast<float>(turn[2]) * local[2];
    }
}

std::size_t age_class(std::int32_t age) {  // frames since the last correction
    return age <= 0 ? 7
                    : std::min<std::size_t>(
                          static_cast<std::size_t>(std::bit_width(static_cast<std::uint32_t>(age))) - 1, 6);
}

std::size_t sign_class(std::int64_t value) { return value < 0 ? 0 : value > 0 ? 2 : 1; }

/// The model of both sides: frame by frame, which vertices change their offset, and by what.
class ChangeCoder {
 public:
    explicit ChangeCoder(const FieldOrder& order)
        : order_(order),
          offsets_(order.vertices.size()),
          changes_(order.vertices.size()),
          changed_at_(order.vertices.size(), -1),
          flags_({8 * 4 * 2, 4 * 4 * 16, 4 * 4, 8 * 16}, 1),
          values_{3 * 4, 3 * 3, 9} {}

    /// wanted(place): the offset that a vertex is to have in this frame; of encoders, looked at once a place.
    /// changed(place): told of each change. False where the stream has ended.
    template <typename Wanted, typename Changed>
    bool code_frame(BitCoder& coder, std::int32_t frame, bool any, Wanted wanted, Changed changed) {
        any = code_bit(coder, any_, any);
        std::size_t count = 0;
        if (any) {
            for (std::size_t place = 0; place < offsets_.size(); ++place) {
                if (code_place(coder, frame, place, wanted)) {
                    changed(place);
                    ++count;
                }
                if ((place & 1023) == 0 && coder.is_overrun()) return false;
            }
        }
        density_ = count == 0 ? 0 : static_cast<std::size_t>(std::bit_width(16384 * count / offsets_.size()));
        return !coder.is_overrun();
    }

    const Offset& offset(std::size_t place) const { return offsets_[place]; }

 private:
    template <typename Wanted>
    bool code_place(BitCoder& coder, std::int32_t frame, std::size_t place, Wanted wanted) {
        std::size_t now = 0, before = 0;
        std::array<std::int64_t, 3> sum{};
        const auto begin = static_cast<std::size_t>(order_.first_neighbour[place]);
        const auto end = static_cast<std::size_t>(order_.first_neighbour[place + 1]);
        for (std::size_t k = begin; k < end; ++k) {
            const auto at = static_cast<std::size_t>(order_.neighbours[k]);
            if (changed_at_[at] == frame) {
                ++now;
                for (std::size_t axis = 0; axis < 3; ++axis) sum[axis] += changes_[at][axis];
            }
            before += changed_at_[at] == frame - 1 && frame > 0;
        }
        Offset& offset = offsets_[place];
        const std::size_t known = std::min<std::size_t>(end - begin, 3);
        const std::size_t age = age_class(changed_at_[place] < 0 ? 0 : frame - changed_at_[place]);
        const std::size_t is_off = offset == Offset{} ? 0 : 1;
        now = std::min<std::size_t>(now, 3);
        before = std::min<std::size_t>(before, 3);
        const std::size_t density = std::min<std::size_t>(density_, 15);
        const std::array<std::size_t, 4> contexts = {(age * 4 + now) * 2 + is_off,
                                                     (known * 4 + now) * 16 + density, before * 4 + now,
                                                     age * 16 + density};
        const Offset target = coder.is_decoder() ? Offset{} : wanted(place);
        if (!flags_.code(coder, target != offset, contexts, 0)) return false;
        std::size_t moved = 0;  // axes so far
        Offset& change = changes_[place];
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const std::array<std::size_t, 3> around = {axis * 4 + moved,
                                                       sign_class(sum[axis]) * 3 + sign_class(offset[axis]),
                                                       axis * 3 + sign_class(sum[axis])};
            change[axis] = values_.code(coder, target[axis] - offset[axis], around);
            moved += change[axis] != 0;
            offset[axis] = static_cast<std::int32_t>(std::clamp<std::int64_t>(
                std::int64_t{offset[axis]} + change[axis], -kLargestOffset, kLargestOffset));
        }
        changed_at_[place] = frame;
        return true;
    }

    const FieldOrder& order_;
    std::vector<Offset> offsets_, changes_;  // by place
    std::vector<std::int32_t> changed_at_;   // frame; -1: never
    AdaptiveBit any_;
    MixedBits flags_;
    MixedIntegers values_;
    std::size_t density_ = 0;  // of changes in the frame before
};

/// The offset of a vertex in one frame: the one it has, if that will do, or one that differs along as few
/// axes as will do. Nothing where none does.
class OffsetChooser {
 public:
    OffsetChooser(double bound) : bound_(bound), step_(step_of(bound)) {}

    bool choose(const float* source, const float* decoded, const BodyMotion& motion, Offset& offset) const {
        if (holds(source, decoded, motion, offset)) return true;
        std::array<double, 3> nearest, distance;
        for (std::size_t k = 0; k < 3; ++k) {
            double local = 0.0;
            for (std::size_t axis = 0; axis < 3; ++axis)
                local += motion.rotation[3 * axis + k] *
                         (static_cast<double>(source[axis]) - static_cast<double>(decoded[axis]));
            nearest[k] = std::floor(local / static_cast<double>(step_) + 0.5);
            if (!(std::abs(nearest[k]) <= kLargestOffset)) return false;
            distance[k] = std::abs(local / static_cast<double>(step_) - static_cast<double>(offset[k]));
        }
        std::array<std::size_t, 3> axes = {0, 1, 2};
        std::sort(axes.begin(), axes.end(),
                  [&](std::size_t a, std::size_t b) { return distance[a] > distance[b]; });
        for (const std::size_t k : axes) {
            offset[k] = static_cast<std::int32_t>(nearest[k]);
            if (holds(source, decoded, motion, offset)) return true;
        }
        return false;
    }

 private:
    bool holds(const float* source, const float* decoded, const BodyMotion& motion,
               const Offset& offset) const {
        std::array<float, 3> place = {decoded[0], decoded[1], decoded[2]};
        move(place.data(), motion, offset, step_);
        return squared_distance(source, place.data()) <= bound_ * bound_;
    }

    double bound_;
    float step_;
};

}  // namespace

Corrections::Corrections(std::span<const Correction> list, double bound, std::int64_t vertex_count)
    : step_(step_of(bound)),
      first_(static_cast<std::size_t>(vertex_count) + 1, 0),
      corrections_(list.size()) {
    for (const Correction& c : list) ++first_[static_cast<std::size_t>(c.vertex) + 1];
    for (std::size_t v = 0; v + 1 < first_.size(); ++v) {
        if (first_[v + 1] > 0) vertices_.push_back(static_cast<std::int32_t>(v));
        first_[v + 1] += first_[v];
    }
    std::vector<std::int32_t> at(first_.begin(), first_.end() - 1);
    for (const Correction& c : list)
        corrections_[static_cast<std::size_t>(at[static_cast<std::size_t>(c.vertex)]++)] = c;
}

void Corrections::apply(std::int64_t begin, MutablePositionsView out, std::span<const std::int32_t> labels,
                        std::span<const BodyTrack> tracks) const {
    for (const std::int32_t v : vertices_) {
        const auto at = static_cast<std::size_t>(v);
        const BodyTrack& track = tracks[static_cast<std::size_t>(labels[at])];
        const auto first = corrections_.begin() + first_[at], end = corrections_.begin() + first_[at + 1];
        // The one after the one that holds in frame `begin`.
        auto next = std::upper_bound(first, end, begin,
                                     [](std::int64_t frame, const Correction& c) { return frame < c.frame; });
        for (std::int64_t f = 0; f < out.frame_count(); ++f) {
            while (next != end && next->frame <= begin + f) ++next;
            if (next == first) continue;
            move(out.at(f, v), track[static_cast<std::size_t>(begin + f)], (next - 1)->offset, step_);
        }
    }
}

Expected<std::vector<std::uint8_t>> encode_corrections(PositionsView source, PositionsView decoded,
                                                       const FieldOrder& order,
                                                       std::span<const std::int32_t> labels,
                                                       std::span<const BodyTrack> tracks, double bound) {
    BitCoder coder;
    ChangeCoder changes(order);
    const OffsetChooser chooser(bound);
    std::vector<Offset> wanted(order.vertices.size());
    for (std::int64_t f = 0; f < source.frame_count(); ++f) {
        bool any = false;
        for (std::size_t place = 0; place < wanted.size(); ++place) {
            const auto v = static_cast<std::size_t>(order.vertices[place]);
            const BodyMotion& motion =
                tracks[static_cast<std::size_t>(labels[v])][static_cast<std::size_t>(f)];
            const auto vertex = static_cast<std::int64_t>(v);
            if (!chooser.choose(source.at(f, vertex), decoded.at(f, vertex), motion, wanted[place])) {
                return fail(ErrorCode::kLimit,
                            "frame " + std::to_string(f) + ", vertex " + std::to_string(v) +
                                ": float32 has no place within the bound; use a larger one");
            }
            any = any || wanted[place] != changes.offset(place);
        }
        changes.code_frame(
            coder, static_cast<std::int32_t>(f), any, [&](std::size_t place) { return wanted[place]; },
            [](std::size_t) {});
    }
    ByteWriter out;
    out.put(bound);
    out.put_bytes(coder.finish());
    return out.take();
}

Expected<double> read_bound(std::span<const std::uint8_t> payload) {
    ByteReader reader(payload);
    const auto bound = reader.get<double>();
    if (!bound) return tl::unexpected(bound.error());
    constexpr float kMost = std::numeric_limits<float>::max();
    if (!(*bound > 0.0 && exact_step(*bound) < static_cast<double>(kMost) && step_of(*bound) < kMost))
        return fail(ErrorCode::kCorrupt, "the bound makes no sense");
    return *bound;
}

Expected<Corrections> decode_corrections(std::span<const std::uint8_t> payload, const FieldOrder& order,
                                         std::int64_t frame_count, std::int64_t size_limit_bytes) {
    const auto bound = read_bound(payload);
    if (!bound) return tl::unexpected(bound.error());
    BitCoder coder(payload.subspan(sizeof(double)));
    ChangeCoder changes(order);
    std::vector<Correction> list;
    const auto most = static_cast<std::size_t>(size_limit_bytes) / (4 * sizeof(Correction));
    for (std::int64_t f = 0; f < frame_count; ++f) {
        const auto frame = static_cast<std::int32_t>(f);
        const bool good = changes.code_frame(
            coder, frame, false, [](std::size_t) { return Offset{}; },
            [&](std::size_t place) {
                if (list.size() <= most)
                    list.push_back({frame, order.vertices[place], changes.offset(place)});
            });
        if (!good) return fail(ErrorCode::kCorrupt, "the corrections do not decode");
        if (list.size() > most) return fail(ErrorCode::kLimit, "more corrections than memory allows");
    }
    if (auto end = coder.check_end(); !end) return tl::unexpected(end.error());
    return Corrections(list, *bound, order.size());
}

}  // namespace batchenc
