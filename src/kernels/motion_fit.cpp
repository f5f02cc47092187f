#include "kernels/motion_fit.h"

#include <algorithm>
#include <cmath>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/motion_fit.cpp"
#include <hwy/foreach_target.h>  // compiles this file once for every instruction set
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace batchenc {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using State = MotionFit::State;
using Motion = MotionFit::Motion;
using Moments = MotionFit::Moments;
using Batch = MotionFit::Batch;
constexpr std::size_t kInputs = MotionFit::kInputs;
constexpr std::int64_t kGroup = MotionFit::kGroup;

// One vertex: x, y, z and a fourth that means nothing; a vector takes them all, or some where it has no room.
using Four = hn::CappedTag<float, 4>;
using FourInts = hn::RebindToSigned<Four>;
using Vector = hn::Vec<Four>;

HWY_INLINE Vector set(float value) { return hn::Set(Four(), value); }

/// Context of a coordinate: by how large its residual is expected to be, and how far the prediction is from a
/// lattice point.
HWY_INLINE hn::Vec<FourInts> context_of(Vector expected, Vector fraction) {
    const FourInts di;
    // Twice the binary logarithm, as the exponent of the square.
    const Vector scaled = hn::Mul(expected, set(1.0f / 0.03f));
    const Vector squared = hn::Mul(hn::Mul(scaled, scaled), set(1.41421356f));
    const auto exponent = hn::Sub(hn::ShiftRight<23>(hn::BitCast(di, squared)), hn::Set(di, 127));
    const auto size_class = hn::Min(hn::Max(exponent, hn::Zero(di)),
                                    hn::Set(di, static_cast<std::int32_t>(MotionFit::kClasses - 1)));
    const auto part = hn::Min(hn::ConvertTo(di, hn::Mul(hn::Abs(fraction), set(8.0f))),
                              hn::Set(di, static_cast<std::int32_t>(MotionFit::kFractions - 1)));
    return hn::Add(hn::ShiftLeft<2>(size_class), part);
}

void predict(const State* states, const Motion* motions, const std::int32_t* places, std::int64_t count,
             Batch& batch) {
    const Four d;
    const FourInts di;
    constexpr float kFurthest = 8388608.0f;  // 2^23: beyond it floats are whole
    for (std::int64_t k = 0; k < count; ++k) {
        const State& state = states[k];
        const std::int32_t* from = places + k * static_cast<std::int64_t>(MotionNeighbours::kCount);
        alignas(16) float missed_around[4];
        for (std::size_t lane = 0; lane < 4; lane += hn::Lanes(d)) {
            Vector missed = hn::Load(d, motions[from[0]].missed + lane);
            for (std::size_t i = 1; i < MotionNeighbours::kCount; ++i)
                missed = hn::Add(missed, hn::Load(d, motions[from[i]].missed + lane));
            hn::Store(missed, d, missed_around + lane);
        }
        const float all = (missed_around[0] + missed_around[1] + missed_around[2]) * (0.3f / 24.0f);
        for (std::size_t lane = 0; lane < 4; lane += hn::Lanes(d)) {
            const Vector residual = hn::Load(d, state.residual + lane);
            Vector moved = hn::Mul(residual, set(state.weights[kInputs]));
            for (std::size_t i = 0; i < MotionNeighbours::kCount; ++i)
                moved = hn::Add(
                    moved, hn::Mul(hn::Load(d, motions[from[i]].displacement + lane), set(state.weights[i])));
            Vector place = hn::Add(hn::Load(d, state.offset + lane), moved);
            place = hn::Min(hn::Max(place, set(-kFurthest)), set(kFurthest));
            const Vector whole = hn::Floor(hn::Add(place, set(0.5f)));
            const Vector fraction = hn::Sub(place, whole);
            const Vector missed = hn::Load(d, missed_around + lane);
            Vector expected =
                hn::Add(hn::Mul(missed, set(0.25f / 8.0f)), hn::Mul(hn::Abs(residual), set(0.1f)));
            expected = hn::Add(expected, hn::Mul(hn::Load(d, state.smoothed + lane), set(0.35f)));
            expected = hn::Add(expected, set(all));
            hn::Store(hn::Add(hn::Load(di, state.point + lane), hn::ConvertTo(di, whole)), di,
                      batch.whole[k] + lane);
            hn::Store(fraction, d, batch.fraction[k] + lane);
            hn::Store(expected, d, batch.expected[k] + lane);
            hn::Store(context_of(expected, fraction), di, batch.context[k] + lane);
        }
    }
}

void record(State* states, Motion* motions, std::int64_t count, const Batch& batch) {
    const Four d;
    const FourInts di;
    for (std::int64_t k = 0; k < count; ++k) {
        State& state = states[k];
        for (std::size_t lane = 0; lane < 4; lane += hn::Lanes(d)) {
            const auto point = hn::Load(di, batch.point[k] + lane);
            const Vector residual =
                hn::Sub(hn::ConvertTo(d, hn::Sub(point, hn::Load(di, batch.whole[k] + lane))),
                        hn::Load(d, batch.fraction[k] + lane));
            // Between the lattice point and the prediction: nearer to the point where residuals are large.
            const Vector trust = hn::Min(
                hn::Add(set(0.3f), hn::Mul(hn::Load(d, batch.expected[k] + lane), set(0.5f))), set(1.0f));
            const Vector towards = hn::Min(hn::Max(hn::Neg(residual), set(-0.5f)), set(0.5f));
            const Vector offset = hn::Mul(hn::Sub(set(1.0f), trust), towards);
            const Vector moved = hn::ConvertTo(d, hn::Sub(point, hn::Load(di, state.point + lane)));
            const Vector target = hn::Sub(moved, hn::Load(d, state.offset + lane));
            const Vector size = hn::Abs(residual), smoothed = hn::Load(d, state.smoothed + lane);
            hn::Store(hn::Load(d, state.residual + lane), d, state.used_residual + lane);
            hn::Store(point, di, state.point + lane);
            hn::Store(offset, d, state.offset + lane);
            hn::Store(residual, d, state.residual + lane);
            hn::Store(hn::Add(smoothed, hn::Mul(set(0.2f), hn::Sub(size, smoothed))), d,
                      state.smoothed + lane);
            hn::Store(target, d, state.target + lane);
            hn::Store(hn::Add(target, offset), d, motions[k].displacement + lane);
            hn::Store(size, d, motions[k].missed + lane);
        }
    }
}

// A group: kGroup vertices, a lane each; a vector takes some of them, `lane` says from which on.
using Wide = hn::CappedTag<float, static_cast<std::size_t>(kGroup)>;
using Lanes = hn::Vec<Wide>;

/// What the fit of a group looks at, gathered: differences of displacements to that of the first neighbour,
/// the last residuals, and what the first weights leave of the targets.
struct Gathered {
    alignas(64) float inputs[kInputs][3][kGroup];
    alignas(64) float targets[3][kGroup];
};

void gather(const State* states, const Motion* motions, const std::int32_t* places,
            const float* first_weights, std::int64_t count, Gathered& g) {
    for (std::int64_t lane = 0; lane < kGroup; ++lane) {
        const std::int64_t k = std::min(lane, count - 1);
        const std::int32_t* from = places + k * static_cast<std::int64_t>(MotionNeighbours::kCount);
        const float* weights = first_weights + k * static_cast<std::int64_t>(MotionNeighbours::kCount);
        const Motion& first = motions[from[0]];
        for (std::size_t c = 0; c < 3; ++c) {
            float left = states[k].target[c] - weights[0] * first.displacement[c];
            for (std::size_t i = 1; i < MotionNeighbours::kCount; ++i) {
                const float value = motions[from[i]].displacement[c];
                g.inputs[i - 1][c][lane] = value - first.displacement[c];
                left = left - weights[i] * value;
            }
            g.inputs[kInputs - 1][c][lane] = states[k].used_residual[c];
            g.targets[c][lane] = left;
        }
    }
}

void accumulate(const Gathered& g, Moments& moments, std::int64_t lane) {
    constexpr float kMemory = 0.99f;
    const Wide d;
    const Lanes memory = hn::Set(d, kMemory);
    const auto input = [&](std::size_t i, std::size_t c) { return hn::Load(d, g.inputs[i][c] + lane); };
    const Lanes t0 = hn::Load(d, g.targets[0] + lane), t1 = hn::Load(d, g.targets[1] + lane),
                t2 = hn::Load(d, g.targets[2] + lane);
    std::size_t at = 0;
    for (std::size_t i = 0; i < kInputs; ++i) {
        const Lanes x = input(i, 0), y = input(i, 1), z = input(i, 2);
        const auto add = [&](float* sum, Lanes a, Lanes b, Lanes c) {
            const Lanes product = hn::Add(hn::Add(hn::Mul(x, a), hn::Mul(y, b)), hn::Mul(z, c));
            hn::Store(hn::Add(hn::Mul(hn::Load(d, sum + lane), memory), product), d, sum + lane);
        };
        for (std::size_t j = 0; j <= i; ++j, ++at)
            add(moments.products[at], input(j, 0), input(j, 1), input(j, 2));
        add(moments.with_target[i], t0, t1, t2);
    }
}

/// Solves (products + ridge) w = with_target by L D L^T; a pivot that has lost its digits counts as without
/// bound, and weights that are out of reason as zero.
void solve(const Moments& moments, float (*solution)[kGroup], std::int64_t lane) {
    constexpr float kRidge = 8.0f, kLostDigits = 1e-5f, kLargest = 16.0f;
    const Wide d;
    const Lanes zero = hn::Zero(d), one = hn::Set(d, 1.0f);
    Lanes lower[MotionFit::kMoments], inverse[kInputs], y[kInputs], w[kInputs];
    for (std::size_t i = 0; i < kInputs; ++i) {
        Lanes u[kInputs];
        const std::size_t row = i * (i + 1) / 2;
        for (std::size_t j = 0; j <= i; ++j) {
            const std::size_t other = j * (j + 1) / 2;
            Lanes sum = hn::Load(d, moments.products[row + j] + lane);
            if (i == j) sum = hn::Add(sum, hn::Set(d, kRidge));
            const Lanes whole = sum;
            for (std::size_t k = 0; k < j; ++k) sum = hn::Sub(sum, hn::Mul(u[k], lower[other + k]));
            if (j < i) {
                u[j] = sum;
                lower[row + j] = hn::Mul(sum, inverse[j]);
            } else {
                const auto is_sound = hn::Gt(sum, hn::Mul(whole, hn::Set(d, kLostDigits)));
                inverse[i] = hn::IfThenElseZero(is_sound, hn::Div(one, sum));
            }
        }
    }
    for (std::size_t i = 0; i < kInputs; ++i) {
        Lanes sum = hn::Load(d, moments.with_target[i] + lane);
        for (std::size_t k = 0; k < i; ++k) sum = hn::Sub(sum, hn::Mul(lower[i * (i + 1) / 2 + k], y[k]));
        y[i] = sum;
    }
    Lanes reasonable = one;
    for (std::size_t i = kInputs; i-- > 0;) {
        Lanes sum = hn::Mul(y[i], inverse[i]);
        for (std::size_t k = i + 1; k < kInputs; ++k)
            sum = hn::Sub(sum, hn::Mul(lower[k * (k + 1) / 2 + i], w[k]));
        w[i] = sum;
        reasonable = hn::IfThenElseZero(hn::Lt(hn::Abs(sum), hn::Set(d, kLargest)), reasonable);
    }
    for (std::size_t i = 0; i < kInputs; ++i)
        hn::Store(hn::IfThenElse(hn::Gt(reasonable, zero), w[i], zero), d, solution[i] + lane);
}

/// Of one group; count: its vertices.
void fit_group(State* states, const Motion* motions, const std::int32_t* places, const float* first_weights,
               std::int64_t count, bool solves, Moments& moments) {
    Gathered gathered;
    gather(states, motions, places, first_weights, count, gathered);
    const auto lanes = static_cast<std::int64_t>(hn::Lanes(Wide()));
    for (std::int64_t lane = 0; lane < kGroup; lane += lanes) accumulate(gathered, moments, lane);
    if (!solves) return;
    alignas(64) float solution[kInputs][kGroup];
    for (std::int64_t lane = 0; lane < kGroup; lane += lanes) solve(moments, solution, lane);
    for (std::int64_t k = 0; k < count; ++k) {
        const float* weights = first_weights + k * static_cast<std::int64_t>(MotionNeighbours::kCount);
        float sum = 0.0f;
        for (std::size_t i = 0; i + 1 < kInputs; ++i) {
            states[k].weights[i + 1] = weights[i + 1] + solution[i][k];
            sum += solution[i][k];
        }
        states[k].weights[0] = weights[0] - sum;
        states[k].weights[kInputs] = solution[kInputs - 1][k];
    }
}

void fit(State* states, const Motion* motions, const MotionNeighbours& neighbours, std::int64_t frame,
         std::int64_t first_group, std::int64_t end_group, Moments* moments) {
    constexpr std::int64_t kEveryFrame = 8;  // at first; then every second one
    const auto vertex_count = static_cast<std::int64_t>(neighbours.order.size());
    for (std::int64_t g = first_group; g < end_group; ++g) {
        const std::int64_t first = g * kGroup;
        const auto row = first * static_cast<std::int64_t>(MotionNeighbours::kCount);
        fit_group(states + first, motions, neighbours.places.data() + row, neighbours.weights.data() + row,
                  std::min(kGroup, vertex_count - first), frame < kEveryFrame || (frame + g) % 2 == 0,
                  moments[g]);
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace batchenc
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace batchenc {
namespace {

HWY_EXPORT(predict);
HWY_EXPORT(record);
HWY_EXPORT(fit);

}  // namespace

double MotionFit::magnitude_of_class(std::size_t c) {
    return 0.03 * std::ldexp(c % 2 == 0 ? 1.0 : 1.4142135623730951, static_cast<int>(c / 2));
}

MotionFit::MotionFit(const MotionNeighbours& neighbours, std::span<const LatticePoint> first_frame,
                     std::span<const float> rest, std::int64_t window)
    : neighbours_(neighbours),
      window_(window),
      slot_(first_frame.size() + 1),
      motions_(std::make_unique<Motion[]>(static_cast<std::size_t>(window) * slot_)),
      states_(first_frame.size()),
      moments_((first_frame.size() + kGroup - 1) / kGroup) {
    for (std::size_t k = 0; k < states_.size(); ++k) {
        const auto v = static_cast<std::size_t>(neighbours.order[k]);
        for (std::size_t c = 0; c < 3; ++c) {
            states_[k].point[c] = first_frame[v][c];
            states_[k].offset[c] = rest[3 * v + c];
            states_[k].smoothed[c] = 1.0f;
        }
        for (std::size_t i = 0; i < MotionNeighbours::kCount; ++i)
            states_[k].weights[i] = neighbours.weights[k * MotionNeighbours::kCount + i];
    }
}

void MotionFit::predict(std::int64_t frame, std::int64_t first, std::int64_t count, Batch& batch) const {
    HWY_DYNAMIC_DISPATCH(predict)
    (states_.data() + first, motions(frame),
     neighbours_.places.data() + first * static_cast<std::int64_t>(MotionNeighbours::kCount), count, batch);
}

void MotionFit::record(std::int64_t frame, std::int64_t first, std::int64_t count, const Batch& batch) {
    HWY_DYNAMIC_DISPATCH(record)(states_.data() + first, motions(frame) + first, count, batch);
}

void MotionFit::fit(std::int64_t frame, std::int64_t first_group, std::int64_t end_group) {
    HWY_DYNAMIC_DISPATCH(fit)
    (states_.data(), motions(frame), neighbours_, frame, first_group, end_group, moments_.data());
}

}  // namespace batchenc
#endif  // HWY_ONCE
