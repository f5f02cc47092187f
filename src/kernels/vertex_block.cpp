#include "kernels/vertex_block.h"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/vertex_block.cpp"
#include <hwy/foreach_target.h>  // compiles this file once for every instruction set
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace batchenc {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// Takes x y z x y z … of kVertexBlock vertices apart, frame after frame. stride: floats from frame to frame.
void separate_axes(const float* HWY_RESTRICT xyz, std::int64_t stride, std::int64_t frame_count,
                   float* HWY_RESTRICT out) {
    const hn::CappedTag<float, 16> d;
    const auto lanes = static_cast<std::int64_t>(hn::Lanes(d));
    for (std::int64_t f = 0; f < frame_count; ++f, xyz += stride, out += 3 * kVertexBlock) {
        for (std::int64_t v = 0; v < kVertexBlock; v += lanes) {
            hn::Vec<decltype(d)> x, y, z;
            hn::LoadInterleaved3(d, xyz + 3 * v, x, y, z);
            hn::Store(x, d, out + v);
            hn::Store(y, d, out + kVertexBlock + v);
            hn::Store(z, d, out + 2 * kVertexBlock + v);
        }
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace batchenc
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace batchenc {

HWY_EXPORT(separate_axes);

void gather_vertex_block(PositionsView positions, std::span<const std::int32_t> vertices, float* block) {
    const auto last = static_cast<std::int64_t>(vertices.size()) - 1;
    for (std::int64_t f = 0; f < positions.frame_count(); ++f, block += 3 * kVertexBlock) {
        for (std::int64_t v = 0; v < kVertexBlock; ++v) {
            const float* p = positions.at(f, vertices[static_cast<std::size_t>(std::min(v, last))]);
            for (std::int64_t axis = 0; axis < 3; ++axis) block[axis * kVertexBlock + v] = p[axis];
        }
    }
}

void load_vertex_block(PositionsView positions, std::int64_t first_vertex, float* block) {
    const std::int64_t count = std::min(kVertexBlock, positions.vertex_count() - first_vertex);
    if (count < kVertexBlock) {
        std::int32_t vertices[kVertexBlock];
        for (std::int64_t v = 0; v < count; ++v) vertices[v] = static_cast<std::int32_t>(first_vertex + v);
        return gather_vertex_block(positions, {vertices, static_cast<std::size_t>(count)}, block);
    }
    HWY_DYNAMIC_DISPATCH(separate_axes)
    (positions.at(0, first_vertex), 3 * positions.vertex_count(), positions.frame_count(), block);
}

VertexBlocks::VertexBlocks(PositionsView positions, const Executor& executor)
    : frame_count_(positions.frame_count()),
      vertex_count_(positions.vertex_count()),
      values_(count() * vertex_block_size(frame_count_)) {
    executor.for_each(count(), [&](std::int64_t index) {
        load_vertex_block(positions, index * kVertexBlock,
                          values_.data() + index * vertex_block_size(frame_count_));
    });
}

}  // namespace batchenc
#endif  // HWY_ONCE
