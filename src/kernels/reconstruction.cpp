#include "kernels/reconstruction.h"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/reconstruction.cpp"
#include <hwy/foreach_target.h>  // compiles this file once for every instruction set
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace batchenc {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// One block of up to four vertices for the frames of one vector. local: 12 × lanes floats of the result,
/// world coordinates.
template <class D>
void block_to_world(D d, const float* HWY_RESTRICT basis, std::int64_t components,
                    const ClusterGeometry& cluster, std::int64_t frame, float* HWY_RESTRICT world) {
    using Vector = hn::Vec<D>;
    const auto lanes = static_cast<std::int64_t>(hn::Lanes(d));
    Vector q[kPackedRows];
    for (Vector& value : q) value = hn::Zero(d);
    const float* c = components > 0 ? cluster.coefficients + frame : nullptr;
    for (std::int64_t l = 0; l < components; ++l, basis += kPackedRows, c += cluster.stride) {
        const Vector coefficient = hn::LoadU(d, c);
        for (std::int64_t r = 0; r < kPackedRows; ++r)
            q[r] = hn::Add(q[r], hn::Mul(hn::Set(d, basis[r]), coefficient));
    }
    const auto track = [&](int k) { return hn::LoadU(d, cluster.frame_track + k * cluster.stride + frame); };
    for (int axis = 0; axis < 3; ++axis) {  // p = Tᵀ q + o
        const Vector tx = track(axis), ty = track(3 + axis), tz = track(6 + axis), o = track(9 + axis);
        for (int v = 0; v < 4; ++v) {
            const Vector xy = hn::Add(hn::Mul(tx, q[3 * v]), hn::Mul(ty, q[3 * v + 1]));
            const Vector p = hn::Add(hn::Add(xy, hn::Mul(tz, q[3 * v + 2])), o);
            hn::StoreU(p, d, world + (3 * v + axis) * lanes);
        }
    }
}

void reconstruct(const ClusterGeometry& cluster, std::int64_t begin, std::int64_t count,
                 float* HWY_RESTRICT out, std::int64_t frame_stride) {
    const hn::CappedTag<float, static_cast<std::size_t>(kFrameLanes)> d;
    const auto lanes = static_cast<std::int64_t>(hn::Lanes(d));
    const std::int64_t components = cluster.basis->component_count;
    const float* basis = cluster.basis->values.data();
    const auto vertex_count = static_cast<std::int64_t>(cluster.vertices.size());
    HWY_ALIGN float world[kPackedRows * kFrameLanes];
    for (std::int64_t first = 0; first < vertex_count; first += 4, basis += kPackedRows * components) {
        const std::int64_t vertices = std::min<std::int64_t>(4, vertex_count - first);
        for (std::int64_t part = 0; part < count; part += lanes) {
            block_to_world(d, basis, components, cluster, begin + part, world);
            const std::int64_t frames = std::min(lanes, count - part);
            for (std::int64_t v = 0; v < vertices; ++v) {
                float* p =
                    out + part * frame_stride + 3 * cluster.vertices[static_cast<std::size_t>(first + v)];
                const float* w = world + 3 * v * lanes;
                for (std::int64_t f = 0; f < frames; ++f, p += frame_stride) {
                    p[0] = w[f];
                    p[1] = w[f + lanes];
                    p[2] = w[f + 2 * lanes];
                }
            }
        }
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace batchenc
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace batchenc {
namespace {
HWY_EXPORT(reconstruct);
}

PackedBasis::PackedBasis(std::int64_t vertices, std::int64_t components)
    : vertex_count(vertices),
      component_count(components),
      values(
          static_cast<std::size_t>((3 * vertices + kPackedRows - 1) / kPackedRows * kPackedRows * components),
          0.0f) {}

void reconstruct_cluster(const ClusterGeometry& cluster, std::int64_t begin, std::int64_t count, float* out,
                         std::int64_t frame_stride) {
    HWY_DYNAMIC_DISPATCH(reconstruct)(cluster, begin, count, out, frame_stride);
}

}  // namespace batchenc
#endif  // HWY_ONCE
