#include "codecs/rlpca_layout.h"

#include <algorithm>
#include <cmath>

#include "codecs/coded_segmentation.h"
#include "kernels/byte_stream.h"

namespace batchenc {
namespace {

tl::unexpected<Error> corrupt(const char* message) { return fail(ErrorCode::kCorrupt, message); }

}  // namespace

std::vector<std::uint8_t> RlpcaHeader::write() const {
    ByteWriter out;
    out.put(static_cast<std::uint8_t>(space));
    out.put(static_cast<std::uint8_t>(basis_bits));
    out.put(static_cast<std::uint8_t>(coefficient_bits));
    out.put(static_cast<std::uint8_t>(lattice.bits));
    out.put_varint(static_cast<std::uint64_t>(components));
    out.put_varint(static_cast<std::uint64_t>(cluster_count));
    for (const float value : lattice.center) out.put(value);
    out.put(lattice.e_max);
    return out.take();
}

Expected<RlpcaHeader> RlpcaHeader::read(std::span<const std::uint8_t> payload, std::int64_t vertex_count) {
    ByteReader reader(payload);
    const auto space = reader.get<std::uint8_t>();
    const auto basis_bits = reader.get<std::uint8_t>();
    const auto coefficient_bits = reader.get<std::uint8_t>();
    const auto frame_bits = reader.get<std::uint8_t>();
    if (!frame_bits) return tl::unexpected(frame_bits.error());
    const auto components = reader.get_varint(4096);
    if (!components) return tl::unexpected(components.error());
    const auto clusters =
        reader.get_varint(std::min<std::uint64_t>(65535, static_cast<std::uint64_t>(vertex_count)));
    if (!clusters) return tl::unexpected(clusters.error());
    RlpcaHeader header;
    const auto center = reader.get_array<float, 3>();
    const auto e_max = reader.get<float>();
    if (!e_max) return tl::unexpected(e_max.error());
    header.lattice.center = *center;  // there, since what follows it is
    if (*space > 1) return corrupt("the coordinate space is unknown");
    header.space = static_cast<CoordinateSpace>(*space);
    header.basis_bits = *basis_bits;
    header.coefficient_bits = *coefficient_bits;
    header.lattice.bits = *frame_bits;
    header.components = static_cast<std::int32_t>(*components);
    header.cluster_count = static_cast<std::int32_t>(*clusters);
    header.lattice.e_max = *e_max;
    const bool finite = std::isfinite(header.lattice.center[0]) && std::isfinite(header.lattice.center[1]) &&
                        std::isfinite(header.lattice.center[2]) && std::isfinite(header.lattice.e_max) &&
                        header.lattice.e_max >= 0.0f;
    CodecParameters parameters;
    parameters.components = header.components;
    parameters.basis_bits = header.basis_bits;
    parameters.coefficient_bits = header.coefficient_bits;
    parameters.frame_bits = header.lattice.bits;
    if (!finite || header.cluster_count == 0 || !check_parameters(parameters))
        return corrupt("a parameter is outside its range");
    if (reader.remaining() != 0) return corrupt("bytes left over");
    return header;
}

LocalFrameTrack RlpcaHeader::world_track(std::int64_t frame_count) const {
    LocalFrame world;
    for (std::size_t c = 0; c < 3; ++c) world.origin[c] = static_cast<double>(lattice.center[c]);
    LocalFrameTrack track(frame_count);
    for (std::int64_t f = 0; f < frame_count; ++f) track.set(f, world);
    return track;
}

RlpcaLayout::RlpcaLayout(std::span<const std::int32_t> labels, std::span<const Triangle> seed_triangles,
                         std::int32_t cluster_count, const MeshAdjacency& adjacency, const Executor& executor)
    : clusters(static_cast<std::size_t>(cluster_count)) {
    ClusterMembers in(labels, seed_triangles, cluster_count);
    std::vector<std::int32_t> position(in.owner.size(), -1);
    executor.for_each(cluster_count, [&](std::int64_t index) {
        const auto i = static_cast<std::size_t>(index);
        clusters[i] =
            traverse_cluster(adjacency, in.members[i], in.owner, static_cast<std::int32_t>(i), position);
    });
    owner = std::move(in.owner);
}

}  // namespace batchenc
