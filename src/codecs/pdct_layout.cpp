#include "codecs/pdct_layout.h"

#include <cmath>

#include "codecs/clip_bitstream.h"
#include "codecs/static_coder.h"
#include "core/parameters.h"
#include "kernels/byte_stream.h"
#include "kernels/signal_order.h"

namespace batchenc {
namespace {

tl::unexpected<Error> corrupt(const char* message) { return fail(ErrorCode::kCorrupt, message); }

void run(const Dct& dct, bool inverse, float* values, float* workspace) {
    if (inverse)
        dct.inverse(values, workspace);
    else
        dct.forward(values, workspace);
}

}  // namespace

std::vector<std::uint8_t> PdctHeader::write() const {
    ByteWriter out;
    out.put(static_cast<std::uint8_t>(bits));
    out.put(static_cast<std::uint8_t>(intra_bits));
    out.put(static_cast<std::uint8_t>(lattice.bits));
    out.put_varint(static_cast<std::uint64_t>(block));
    out.put_varint(static_cast<std::uint64_t>(cluster_count));
    for (const float value : lattice.center) out.put(value);
    out.put(lattice.e_max);
    return out.take();
}

Expected<PdctHeader> PdctHeader::read(std::span<const std::uint8_t> payload, std::int64_t vertex_count) {
    ByteReader reader(payload);
    const auto bits = reader.get<std::uint8_t>();
    const auto intra_bits = reader.get<std::uint8_t>();
    const auto frame_bits = reader.get<std::uint8_t>();
    if (!frame_bits) return tl::unexpected(frame_bits.error());
    const auto block = reader.get_varint(256);
    if (!block) return tl::unexpected(block.error());
    const auto clusters =
        reader.get_varint(std::min<std::uint64_t>(65535, static_cast<std::uint64_t>(vertex_count)));
    if (!clusters) return tl::unexpected(clusters.error());
    const auto center = reader.get_array<float, 3>();
    const auto e_max = reader.get<float>();
    if (!e_max) return tl::unexpected(e_max.error());
    PdctHeader header;
    header.bits = *bits;
    header.intra_bits = *intra_bits;
    header.block = static_cast<std::int32_t>(*block);
    header.cluster_count = static_cast<std::int32_t>(*clusters);
    header.lattice.center = *center;  // there, since what follows it is
    header.lattice.e_max = *e_max;
    header.lattice.bits = *frame_bits;
    bool finite = std::isfinite(*e_max) && *e_max >= 0.0f;
    for (const float value : header.lattice.center) finite = finite && std::isfinite(value);
    CodecParameters parameters;
    parameters.method = CodecMethod::kPdct;
    parameters.bits = header.bits;
    parameters.intra_bits = header.intra_bits;
    parameters.frame_bits = header.lattice.bits;
    if (!finite || header.cluster_count == 0 || header.block == 0 || !check_parameters(parameters))
        return corrupt("a parameter is outside its range");
    if (reader.remaining() != 0) return corrupt("bytes left over");
    return header;
}

ClusterTransform::ClusterTransform(std::int64_t columns, std::int64_t block)
    : columns_(columns),
      block_(block),
      stride_((3 * columns + kDctLanes - 1) / kDctLanes * kDctLanes),
      along_space_(columns),
      along_time_(block) {}

std::int64_t ClusterTransform::workspace_size() const {
    const Dct& larger =
        along_space_.workspace_size() > along_time_.workspace_size() ? along_space_ : along_time_;
    return larger.workspace_size() + std::max(columns_, block_) * kDctLanes;
}

void ClusterTransform::space(float* rows, std::int64_t count, float* workspace, bool inverse) const {
    float* panel = workspace;
    float* rest = workspace + columns_ * kDctLanes;
    for (std::int64_t first = 0; first < count; first += kDctLanes) {
        const std::int64_t lanes = std::min(kDctLanes, count - first);
        for (std::int64_t c = 0; c < 3; ++c) {
            float* corner = rows + first * stride_ + c;
            if (lanes < kDctLanes) std::fill_n(panel, columns_ * kDctLanes, 0.0f);
            for (std::int64_t lane = 0; lane < lanes; ++lane) {
                const float* row = corner + lane * stride_;
                for (std::int64_t k = 0; k < columns_; ++k) panel[k * kDctLanes + lane] = row[3 * k];
            }
            run(along_space_, inverse, panel, rest);
            for (std::int64_t lane = 0; lane < lanes; ++lane) {
                float* row = corner + lane * stride_;
                for (std::int64_t k = 0; k < columns_; ++k) row[3 * k] = panel[k * kDctLanes + lane];
            }
        }
    }
}

void ClusterTransform::time(float* rows, std::int64_t count, float* workspace, bool inverse) const {
    if (count == 1) return;
    float* panel = workspace;
    float* rest = workspace + block_ * kDctLanes;
    const auto transform_with = [&](const Dct& dct) {
        for (std::int64_t column = 0; column < stride_; column += kDctLanes) {
            for (std::int64_t t = 0; t < count; ++t)
                std::copy_n(rows + t * stride_ + column, kDctLanes, panel + t * kDctLanes);
            run(dct, inverse, panel, rest);
            for (std::int64_t t = 0; t < count; ++t)
                std::copy_n(panel + t * kDctLanes, kDctLanes, rows + t * stride_ + column);
        }
    };
    if (count == block_)
        transform_with(along_time_);
    else
        transform_with(Dct(count));  // a clip's last block
}

void ClusterTransform::forward_space(float* rows, std::int64_t count, float* workspace) const {
    space(rows, count, workspace, false);
}
void ClusterTransform::inverse_space(float* rows, std::int64_t count, float* workspace) const {
    space(rows, count, workspace, true);
}
void ClusterTransform::forward_time(float* rows, std::int64_t count, float* workspace) const {
    time(rows, count, workspace, false);
}
void ClusterTransform::inverse_time(float* rows, std::int64_t count, float* workspace) const {
    time(rows, count, workspace, true);
}

Expected<EncodedClip> encode_intra(PositionsView frame, const MeshTopology& mesh,
                                   const CodecParameters& parameters, const Executor& executor) {
    CodecParameters intra = parameters;
    intra.method = CodecMethod::kStatic;
    intra.bits = parameters.intra_bits;
    if (intra.predictor == GeometryPredictor::kAuto) intra.predictor = GeometryPredictor::kWeighted;
    return encode_static(frame, mesh, intra, executor);
}

ClusterTraversal order_points(std::span<const std::int32_t> members, std::span<float> local) {
    ClusterTraversal traversal;
    traversal.vertices.reserve(members.size());
    const std::vector<float> in_order_of_members(local.begin(), local.end());
    auto to = local.begin();
    for (const std::int32_t place : curve_order(in_order_of_members)) {
        traversal.vertices.push_back(members[static_cast<std::size_t>(place)]);
        to = std::copy_n(in_order_of_members.begin() + 3 * static_cast<std::ptrdiff_t>(place), 3, to);
    }
    // The point before, and the one before that: what is near along the curve.
    const auto none = static_cast<std::int32_t>(members.size());
    traversal.predecessors.assign(members.size() * ClusterTraversal::kMaxPredecessors, none);
    traversal.predecessor_count.resize(members.size());
    for (std::size_t at = 0; at < members.size(); ++at) {
        const std::size_t count = std::min<std::size_t>(at, 2);
        for (std::size_t k = 0; k < count; ++k)
            traversal.predecessors[at * ClusterTraversal::kMaxPredecessors + k] =
                static_cast<std::int32_t>(at - 1 - k);
        traversal.predecessor_count[at] = static_cast<std::uint8_t>(count);
    }
    return traversal;
}

}  // namespace batchenc
