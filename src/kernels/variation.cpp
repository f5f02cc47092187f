#include "kernels/variation.h"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/variation.cpp"
#include <hwy/foreach_target.h>  // compiles this file once for every instruction set
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace batchenc {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// All frames of one block in one cluster. rows: kVariationRows × kVertexBlock.
void vary(const float* HWY_RESTRICT block, std::int64_t frame_count, const LocalFrameTrack& track,
          float* HWY_RESTRICT rows) {
    const hn::CappedTag<float, 16> d;
    const auto lanes = static_cast<std::int64_t>(hn::Lanes(d));
    using Vector = hn::Vec<decltype(d)>;
    const float* values = track.values.data();
    const std::int64_t stride = track.stride;
    const Vector share = hn::Set(d, 1.0f / static_cast<float>(frame_count));

    for (std::int64_t at = 0; at < kVertexBlock; at += lanes) {
        const auto local = [&](std::int64_t f, Vector& x, Vector& y, Vector& z) {
            const float* p = block + f * 3 * kVertexBlock + at;
            const auto value = [&](int k) { return hn::Set(d, values[k * stride + f]); };
            const Vector px = hn::Sub(hn::Load(d, p), value(9));
            const Vector py = hn::Sub(hn::Load(d, p + kVertexBlock), value(10));
            const Vector pz = hn::Sub(hn::Load(d, p + 2 * kVertexBlock), value(11));
            const auto axis = [&](int k) {
                return hn::MulAdd(value(k), px, hn::MulAdd(value(k + 1), py, hn::Mul(value(k + 2), pz)));
            };
            x = axis(0);
            y = axis(3);
            z = axis(6);
        };
        Vector first_x, first_y, first_z;
        local(0, first_x, first_y, first_z);
        Vector sum_x = hn::Zero(d), sum_y = sum_x, sum_z = sum_x, square = sum_x;
        for (std::int64_t f = 1; f < frame_count; ++f) {
            Vector x, y, z;
            local(f, x, y, z);
            x = hn::Sub(x, first_x);
            y = hn::Sub(y, first_y);
            z = hn::Sub(z, first_z);
            sum_x = hn::Add(sum_x, x);
            sum_y = hn::Add(sum_y, y);
            sum_z = hn::Add(sum_z, z);
            square = hn::Add(square, hn::MulAdd(x, x, hn::MulAdd(y, y, hn::Mul(z, z))));
        }
        // sum of |m - mean|^2 = sum of |m|^2 - F |mean|^2, with m the move from the first frame's place.
        const Vector x = hn::Mul(sum_x, share), y = hn::Mul(sum_y, share), z = hn::Mul(sum_z, share);
        const Vector explained = hn::MulAdd(x, sum_x, hn::MulAdd(y, sum_y, hn::Mul(z, sum_z)));
        const auto store = [&](VariationRow row, Vector value) {
            hn::StoreU(value, d, rows + row * kVertexBlock + at);
        };
        store(kVariation, hn::Max(hn::Zero(d), hn::Sub(square, explained)));
        store(kMeanX, hn::Add(first_x, x));
        store(kMeanY, hn::Add(first_y, y));
        store(kMeanZ, hn::Add(first_z, z));
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace batchenc
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace batchenc {

HWY_EXPORT(vary);

void variation_block(const float* block, std::int64_t frame_count, std::span<const LocalFrameTrack> tracks,
                     std::span<float> rows) {
    for (std::size_t i = 0; i < tracks.size(); ++i) {
        HWY_DYNAMIC_DISPATCH(vary)
        (block, frame_count, tracks[i], rows.data() + i * kVariationRows * kVertexBlock);
    }
}

}  // namespace batchenc
#endif  // HWY_ONCE
