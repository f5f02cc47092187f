#include "codecs/rtpca_layout.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "kernels/byte_stream.h"

namespace batchenc {
float RtpcaHeader::fine_step(std::int64_t count) const {
    const double step_of_all =
        static_cast<double>(step) / std::sqrt(static_cast<double>(std::max<std::int64_t>(1, count)));
    return static_cast<float>(std::max(step_of_all, static_cast<double>(e_max) * 0x1p-24));
}

std::vector<std::uint8_t> RtpcaHeader::write() const {
    ByteWriter out;
    out.put(step);
    out.put(e_max);
    for (const float value : center) out.put(value);
    out.put_varint(static_cast<std::uint64_t>(cluster_count));
    out.put_varint(static_cast<std::uint64_t>(component_count));
    return out.take();
}

Expected<RtpcaHeader> RtpcaHeader::read(std::span<const std::uint8_t> payload, std::int64_t vertex_count) {
    ByteReader reader(payload);
    RtpcaHeader header;
    const auto floats = reader.get_array<float, 5>();
    if (!floats) return tl::unexpected(floats.error());
    header.step = (*floats)[0];
    header.e_max = (*floats)[1];
    std::copy_n(floats->begin() + 2, 3, header.center.begin());
    const auto clusters =
        reader.get_varint(std::min<std::uint64_t>(65535, static_cast<std::uint64_t>(vertex_count)));
    if (!clusters) return tl::unexpected(clusters.error());
    const auto components = reader.get_varint(std::uint64_t{1} << 31);
    if (!components) return tl::unexpected(components.error());
    header.cluster_count = static_cast<std::int32_t>(*clusters);
    header.component_count = static_cast<std::int64_t>(*components);
    const bool finite = std::all_of(floats->begin(), floats->end(), [](float v) { return std::isfinite(v); });
    if (!finite || header.e_max < 0.0f || header.step < 0.0f || header.cluster_count == 0 ||
        reader.remaining() != 0)
        return fail(ErrorCode::kCorrupt, "the parameters make no sense");
    return header;
}

float RtpcaComponent::basis_step() const {
    constexpr std::array<float, 4> kQuarters = {1.0f, 0.840896415f, 0.707106781f, 0.594603558f};
    return 1.25f * std::ldexp(kQuarters[static_cast<std::size_t>(scale % 4)], -(scale / 4));
}

double CodedBody::joint_cell(const RtpcaHeader& header) {
    constexpr double kCells = 4096.0;
    return static_cast<double>(header.e_max) / kCells;
}

std::array<double, 3> CodedBody::joint_place(const RtpcaHeader& header) const {
    const double cell = joint_cell(header);
    return {joint[0] * cell, joint[1] * cell, joint[2] * cell};
}

double CodedBody::rotation_step(const RtpcaHeader& header, std::int64_t vertices) const {
    // A turn by a vector of three errors of variance s² / 12 moves a vertex at distance r by 2 r² s² / 12.
    const double scale = radius % 2 == 0 ? 1.0 : 0.70710678118654752;
    const double r = std::ldexp(static_cast<double>(header.e_max) * scale, -(radius / 2));
    return r > 0.0 ? static_cast<double>(header.body_step(vertices)) / r * 1.2247448713915890 : 0.0;
}

BodyTrack CodedBody::track(const BodyTrack* parent_track, const RtpcaHeader& header, std::int64_t vertices,
                           const TrackTransform& transform) const {
    const std::array<TrackLevels, 2> levels = {rotation, path};
    const std::vector<std::vector<float>> values = transform.dequantize(levels, SerialExecutor());
    const std::array<double, 3> at_rest = joint_place(header);
    const double turn = rotation_step(header, vertices);
    const auto step = static_cast<double>(header.body_step(vertices));
    BodyTrack result(values[0].size() / 3);
    for (std::size_t f = 0; f < result.size(); ++f) {
        const float* v = values[0].data() + 3 * f;
        const float* s = values[1].data() + 3 * f;
        BodyMotion motion;
        motion.rotation = rotation_of({static_cast<double>(v[0]) * turn, static_cast<double>(v[1]) * turn,
                                       static_cast<double>(v[2]) * turn});
        const std::array<double, 3> turned = motion.apply(at_rest);
        for (std::size_t axis = 0; axis < 3; ++axis)
            motion.translation[axis] = static_cast<double>(s[axis]) * step - turned[axis];
        result[f] = parent_track != nullptr ? (*parent_track)[f].after(motion) : motion;
    }
    return result;
}

bool code_bodies(BitCoder& coder, std::span<CodedBody> bodies, std::int64_t frame_count) {
    AdaptiveNumber parents(static_cast<std::uint32_t>(bodies.size()));
    AdaptiveNumber radii(CodedBody::kLargestRadius);
    MixedIntegers joints{1};
    TrackCoder rotations(frame_count), paths(frame_count);
    constexpr std::array<std::size_t, 1> kNoContext = {0};
    for (CodedBody& body : bodies) {
        const std::uint32_t parent = parents.code(coder, static_cast<std::uint32_t>(body.parent + 1));
        const std::uint32_t radius = radii.code(coder, static_cast<std::uint32_t>(body.radius));
        if (parent > bodies.size() || radius > CodedBody::kLargestRadius) return false;
        body.parent = static_cast<std::int32_t>(parent) - 1;
        body.radius = static_cast<std::int32_t>(radius);
        for (std::int32_t& value : body.joint) value = joints.code(coder, value, kNoContext);
        rotations.code(coder, body.rotation, 0);
        paths.code(coder, body.path, 0);
        if (coder.is_overrun()) return false;
    }
    return true;
}

bool code_components(BitCoder& coder, std::span<RtpcaComponent> components, std::int32_t cluster_count) {
    AdaptiveCount steps;
    AdaptiveNumber clusters(static_cast<std::uint32_t>(cluster_count - 1));
    std::int32_t scale = RtpcaComponent::kLargestScale;
    for (RtpcaComponent& component : components) {
        const std::uint64_t down = steps.code(coder, static_cast<std::uint64_t>(scale - component.scale));
        const std::uint32_t cluster = clusters.code(coder, static_cast<std::uint32_t>(component.cluster));
        if (down > static_cast<std::uint64_t>(scale) ||
            cluster >= static_cast<std::uint32_t>(cluster_count) || coder.is_overrun())
            return false;
        scale -= static_cast<std::int32_t>(down);
        component = {static_cast<std::int32_t>(cluster), scale};
    }
    return true;
}

std::vector<FieldOrder> cluster_orders(const MeshTopology& mesh, std::span<const std::int32_t> labels,
                                       std::int32_t cluster_count, std::span<const float> shape) {
    return mesh.is_points() ? FieldOrder::along_curve(shape, labels, cluster_count)
                            : FieldOrder::of(mesh, labels, cluster_count);
}

void append_parts(ByteWriter& out, std::span<const std::vector<std::uint8_t>> parts) {
    for (std::size_t k = 0; k + 1 < parts.size(); ++k) out.put_varint(parts[k].size());
    for (const auto& part : parts) out.put_bytes(part);
}

Expected<std::vector<std::span<const std::uint8_t>>> split_parts(std::span<const std::uint8_t> payload,
                                                                 std::size_t count) {
    ByteReader reader(payload);
    std::vector<std::uint64_t> sizes;
    for (std::size_t k = 0; k + 1 < count; ++k) {
        const auto size = reader.get_varint(reader.remaining());
        if (!size) return tl::unexpected(size.error());
        sizes.push_back(*size);
    }
    std::vector<std::span<const std::uint8_t>> parts;
    for (const std::uint64_t size : sizes) {
        const auto part = reader.get_bytes(size);
        if (!part) return tl::unexpected(part.error());
        parts.push_back(*part);
    }
    parts.push_back(payload.subspan(reader.position()));
    return parts;
}

std::vector<FieldMemory> stream_memories(const std::vector<std::int32_t>& stream,
                                         const std::vector<FieldOrder>& orders) {
    std::vector<FieldMemory> memories(orders.size(), FieldMemory(0));
    for (const std::int32_t i : stream)
        memories[static_cast<std::size_t>(i)] = FieldMemory(orders[static_cast<std::size_t>(i)].size());
    return memories;
}

Streams rtpca_streams(std::span<const RtpcaComponent> components, std::span<const std::int64_t> sizes,
                      std::int64_t frame_count) {
    std::vector<std::int64_t> values(sizes.size(), 0);
    for (const RtpcaComponent& component : components) {
        const auto i = static_cast<std::size_t>(component.cluster);
        values[i] += sizes[i] + 3 * frame_count;
    }
    return deal_streams(values, kRtpcaValuesPerStream);
}

}  // namespace batchenc
