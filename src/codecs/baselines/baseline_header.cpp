#include "codecs/baselines/baseline_header.h"

#include <cmath>

#include "kernels/bounding_box.h"
#include "kernels/byte_stream.h"

namespace batchenc {

Expected<BaselineHeader> BaselineHeader::of(PositionsView positions, const CodecParameters& parameters) {
    const BoundingBox box = bounding_box(positions);
    BaselineHeader header;
    header.bits = parameters.bits;
    header.basis_bits = parameters.basis_bits;
    header.coefficient_bits = parameters.coefficient_bits;
    header.lpc_order = parameters.lpc_order;
    header.predictor = parameters.predictor;
    header.center = box.center();
    header.largest_side = static_cast<float>(box.largest_side());
    if (!std::isfinite(header.largest_side))
        return fail(ErrorCode::kLimit, "the bounding box is larger than float32 can say");
    return header;
}

double BaselineHeader::step() const { return std::ldexp(static_cast<double>(largest_side), -bits); }

std::vector<std::uint8_t> BaselineHeader::write() const {
    ByteWriter out;
    for (const std::int32_t value : {bits, basis_bits, coefficient_bits, lpc_order})
        out.put(static_cast<std::uint8_t>(value));
    out.put(static_cast<std::uint8_t>(predictor));
    out.put_varint(static_cast<std::uint64_t>(components));
    out.put_varint(static_cast<std::uint64_t>(cluster_count));
    for (const float value : center) out.put(value);
    out.put(largest_side);
    return out.take();
}

Expected<BaselineHeader> BaselineHeader::read(std::span<const std::uint8_t> payload) {
    constexpr std::uint64_t kMostComponents = 4096, kMostClusters = 65535;
    ByteReader reader(payload);
    BaselineHeader header;
    const auto numbers = reader.get_array<std::uint8_t, 4>();
    const auto predictor = reader.get<std::uint8_t>();
    const auto components = reader.get_varint(kMostComponents);
    const auto clusters = reader.get_varint(kMostClusters);
    const auto center = reader.get_array<float, 3>();
    const auto side = reader.get<float>();
    if (!numbers || !predictor || !components || !clusters || !center || !side)
        return fail(ErrorCode::kCorrupt, "the parameters end too early or are out of range");
    header.bits = (*numbers)[0];
    header.basis_bits = (*numbers)[1];
    header.coefficient_bits = (*numbers)[2];
    header.lpc_order = (*numbers)[3];
    header.predictor = static_cast<GeometryPredictor>(*predictor);
    header.components = static_cast<std::int32_t>(*components);
    header.cluster_count = static_cast<std::int32_t>(*clusters);
    header.center = *center;
    header.largest_side = *side;
    const auto within = [](std::int32_t value, std::int32_t low, std::int32_t high) {
        return value >= low && value <= high;
    };
    bool good = within(header.bits, 4, 20) && within(header.basis_bits, 2, 20) &&
                within(header.coefficient_bits, 2, 20) && within(header.lpc_order, 1, 2) &&
                to_name(header.predictor) != "unknown" && std::isfinite(header.largest_side) &&
                header.largest_side >= 0.0f;
    for (const float value : header.center) good = good && std::isfinite(value);
    if (!good) return fail(ErrorCode::kCorrupt, "a parameter is outside its range");
    if (reader.remaining() != 0) return fail(ErrorCode::kCorrupt, "bytes left over");
    return header;
}

Expected<void> check_size(const ClipBitstream& clip, std::int64_t size_limit_bytes,
                          std::int64_t bytes_per_vertex, std::int64_t bytes_per_sample) {
    if (clip.vertex_count <= size_limit_bytes / bytes_per_vertex &&
        clip.frame_count <=
            (size_limit_bytes - clip.vertex_count * bytes_per_vertex) / bytes_per_sample / clip.vertex_count)
        return {};
    return fail(ErrorCode::kLimit,
                "the clip needs more memory than allowed: " + std::to_string(clip.vertex_count) +
                    " vertices, " + std::to_string(clip.frame_count) + " frames");
}

}  // namespace batchenc
