#include "kernels/deviation.h"

#include <algorithm>
#include <cstddef>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/deviation.cpp"
#include <hwy/foreach_target.h>  // compiles this file once for every instruction set
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace batchenc {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

constexpr std::int64_t kBlock = kVertexBlock;

/// Adds the deviation over frames [begin, end) against the frame before each, for one cluster.
/// block: [frame][xyz][kBlock], from frame 0.
void add(const float* HWY_RESTRICT block, std::int64_t begin, std::int64_t end, const LocalFrameTrack& track,
         float* HWY_RESTRICT theta) {
    const hn::CappedTag<float, 16> d;
    const auto lanes = static_cast<std::int64_t>(hn::Lanes(d));
    using Vector = hn::Vec<decltype(d)>;
    const float* values = track.values.data();
    const std::int64_t stride = track.stride;

    // Two vectors of vertices at once hide the latency of the products and share the broadcast of the LCF.
    for (std::int64_t at = 0; at < kBlock; at += 2 * lanes) {
        Vector sum0 = hn::Zero(d), sum1 = hn::Zero(d);
        Vector x0 = sum0, y0 = sum0, z0 = sum0, x1 = sum0, y1 = sum0, z1 = sum0;
        for (std::int64_t f = begin - 1; f < end; ++f) {
            const float* p = block + f * 3 * kBlock + at;
            const auto value = [&](int k) { return hn::Set(d, values[k * stride + f]); };
            const Vector ox = value(9), oy = value(10), oz = value(11);
            const Vector px0 = hn::Sub(hn::Load(d, p), ox);
            const Vector py0 = hn::Sub(hn::Load(d, p + kBlock), oy);
            const Vector pz0 = hn::Sub(hn::Load(d, p + 2 * kBlock), oz);
            const Vector px1 = hn::Sub(hn::Load(d, p + lanes), ox);
            const Vector py1 = hn::Sub(hn::Load(d, p + kBlock + lanes), oy);
            const Vector pz1 = hn::Sub(hn::Load(d, p + 2 * kBlock + lanes), oz);
            const auto axis = [&](int k, Vector& q0, Vector& q1) {
                const Vector tx = value(k), ty = value(k + 1), tz = value(k + 2);
                const Vector new0 = hn::MulAdd(tx, px0, hn::MulAdd(ty, py0, hn::Mul(tz, pz0)));
                const Vector new1 = hn::MulAdd(tx, px1, hn::MulAdd(ty, py1, hn::Mul(tz, pz1)));
                const Vector move0 = hn::Sub(new0, q0);
                const Vector move1 = hn::Sub(new1, q1);
                q0 = new0;
                q1 = new1;
                sum0 = hn::MulAdd(move0, move0, sum0);
                sum1 = hn::MulAdd(move1, move1, sum1);
            };
            axis(0, x0, x1);
            axis(3, y0, y1);
            axis(6, z0, z1);
            if (f < begin) sum0 = sum1 = hn::Zero(d);  // the first q has no predecessor
        }
        hn::StoreU(hn::Add(hn::LoadU(d, theta + at), sum0), d, theta + at);
        hn::StoreU(hn::Add(hn::LoadU(d, theta + at + lanes), sum1), d, theta + at + lanes);
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace batchenc
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace batchenc {

HWY_EXPORT(add);

void add_deviation(const float* block, std::int64_t begin, std::int64_t end, const LocalFrameTrack& track,
                   float* theta) {
    HWY_DYNAMIC_DISPATCH(add)(block, begin, end, track, theta);
}

void deviation_block(const float* block, std::int64_t frame_count, std::span<const LocalFrameTrack> tracks,
                     std::span<float> theta) {
    std::fill(theta.begin(), theta.end(), 0.0f);
    for (std::int64_t begin = 1; begin < frame_count; begin += kDeviationRun) {
        const std::int64_t end = std::min(begin + kDeviationRun, frame_count);
        for (std::size_t i = 0; i < tracks.size(); ++i)
            add_deviation(block, begin, end, tracks[i], theta.data() + i * kVertexBlock);
    }
}

double deviation_flop(std::int64_t frames, std::int64_t vertices, std::int64_t clusters) {
    return 27.0 * static_cast<double>(frames) * static_cast<double>(vertices) * static_cast<double>(clusters);
}

}  // namespace batchenc
#endif  // HWY_ONCE
