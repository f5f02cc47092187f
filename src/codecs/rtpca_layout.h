#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "codecs/clip_codec.h"
#include "codecs/coded_streams.h"
#include "codecs/field_coder.h"
#include "codecs/track_coder.h"
#include "core/error.h"
#include "kernels/field_order.h"
#include "kernels/mesh_topology.h"
#include "kernels/rigid_tree.h"

namespace batchenc {

// What encoder and decoder of RTPCA derive alike.

/// The content of the parameters section.
struct RtpcaHeader {
    float step = 0.0f;   ///< d, of coefficients, world units
    float e_max = 0.0f;  ///< largest side of the clip's bounding box
    std::array<float, 3> center{};
    std::int32_t cluster_count = 0;    ///< N
    std::int64_t component_count = 0;  ///< of all clusters together

    /// Of the mean shape: d over the root of F, as an error there is one in every frame.
    float shape_step(std::int64_t frame_count) const { return fine_step(frame_count); }
    /// Of the place of a cluster of n vertices: d over the root of n.
    float body_step(std::int64_t vertices) const { return fine_step(vertices); }

    std::vector<std::uint8_t> write() const;
    /// Error: kCorrupt.
    static Expected<RtpcaHeader> read(std::span<const std::uint8_t> payload, std::int64_t vertex_count);

 private:
    /// No finer than float32 holds.
    float fine_step(std::int64_t count) const;
};

/// A principal component of one cluster; importance is the order in which they stand.
struct RtpcaComponent {
    std::int32_t cluster = 0;
    std::int32_t scale = 0;  ///< its singular value is about d 2^(scale / 4)

    static constexpr std::int32_t kLargestScale = 255;
    /// 1.25 × 2^(-scale / 4): the step of its basis, which has unit norm.
    float basis_step() const;
};

/// The motion of one cluster as it is coded: in the frame of its parent, rotation vectors and the path of a
/// joint.
struct CodedBody {
    std::int32_t parent = -1;
    std::array<std::int32_t, 3> joint{};  ///< at rest, about the centre, in e_max / 4096
    std::int32_t radius = 0;              ///< of its vertices about the joint: e_max 2^(-radius / 2)
    TrackLevels rotation, path;

    static constexpr std::int32_t kLargestRadius = 48;
    /// What encoders choose by: of both tracks.
    float cost() const { return rotation.cost + path.cost; }
    static double joint_cell(const RtpcaHeader& header);                 ///< e_max / 4096
    std::array<double, 3> joint_place(const RtpcaHeader& header) const;  ///< about the centre, world units
    double rotation_step(const RtpcaHeader& header, std::int64_t vertices) const;  ///< radians

    /// The motions it stands for. parent_track: decoded; null for the world. vertices: of the cluster.
    BodyTrack track(const BodyTrack* parent_track, const RtpcaHeader& header, std::int64_t vertices,
                    const TrackTransform& transform) const;
};

/// Codes the motions in either direction. bodies: N; when decoding, tracks have their sizes. False when the
/// stream is seen to be corrupt.
bool code_bodies(BitCoder& coder, std::span<CodedBody> bodies, std::int64_t frame_count);

/// Codes the list of components in either direction. False when the stream is seen to be corrupt.
bool code_components(BitCoder& coder, std::span<RtpcaComponent> components, std::int32_t cluster_count);

/// The orders of the clusters' coefficients. shape: 3 × V, the decoded mean shape.
std::vector<FieldOrder> cluster_orders(const MeshTopology& mesh, std::span<const std::int32_t> labels,
                                       std::int32_t cluster_count, std::span<const float> shape);

/// Values of a coded stream (see deal_streams).
inline constexpr std::int64_t kRtpcaValuesPerStream = std::int64_t{1} << 17;

/// Clusters that share streams, of basis and of coefficients alike. sizes: vertices of each cluster.
Streams rtpca_streams(std::span<const RtpcaComponent> components, std::span<const std::int64_t> sizes,
                      std::int64_t frame_count);

/// The parts of a section: sizes of all but the last, then bytes.
void append_parts(ByteWriter& out, std::span<const std::vector<std::uint8_t>> parts);
/// The way back. count: of the parts, at least 1. Error: kCorrupt.
Expected<std::vector<std::span<const std::uint8_t>>> split_parts(std::span<const std::uint8_t> payload,
                                                                 std::size_t count);

/// A memory for every cluster, of which those outside the stream are of no size.
std::vector<FieldMemory> stream_memories(const std::vector<std::int32_t>& stream,
                                         const std::vector<FieldOrder>& orders);

/// Calls use(component, cluster, rank in the cluster) for the components of the clusters of a stream, most
/// important first, until it returns false; so does this call then.
template <typename Use>
bool for_each_component(std::span<const RtpcaComponent> components, const std::vector<std::int32_t>& stream,
                        std::size_t cluster_count, Use use) {
    std::vector<std::uint8_t> is_in(cluster_count, 0);
    for (const std::int32_t i : stream) is_in[static_cast<std::size_t>(i)] = 1;
    std::vector<std::size_t> ranks(cluster_count, 0);
    for (const RtpcaComponent& component : components) {
        const auto i = static_cast<std::size_t>(component.cluster);
        if (is_in[i] != 0 && !use(component, i, ranks[i]++)) return false;
    }
    return true;
}

}  // namespace batchenc
