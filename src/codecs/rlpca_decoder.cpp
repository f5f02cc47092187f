#include <algorithm>
#include <cmath>

#include "codecs/coded_segmentation.h"
#include "codecs/coded_streams.h"
#include "codecs/integer_contexts.h"
#include "codecs/rlpca.h"
#include "codecs/rlpca_layout.h"
#include "kernels/byte_stream.h"
#include "kernels/quantizer.h"
#include "kernels/reconstruction.h"

namespace batchenc {
namespace {

Expected<MinMaxQuantizer> read_quantizer(ByteReader& reader, int bits) {
    const auto low = reader.get<float>();
    const auto step = reader.get<float>();
    if (!low || !step) return fail(ErrorCode::kCorrupt, "the table of quantisers ends too early");
    const MinMaxQuantizer quantizer{*low, *step};
    const bool finite = std::isfinite(*low) && std::isfinite(*step) &&
                        std::isfinite(quantizer.dequantize(std::int32_t{1} << bits));
    if (!finite || *step < 0.0f) return fail(ErrorCode::kCorrupt, "a quantiser is not finite");
    return quantizer;
}

/// Turns levels relative to zero into values. False for a level outside the scale.
template <typename Store>
bool dequantize_levels(std::span<const std::int32_t> levels, const MinMaxQuantizer& quantizer, int bits,
                       Store store) {
    const std::int32_t zero = quantizer.zero_level(bits);
    const auto top = std::uint32_t{1} << bits;
    bool good = true;
    for (std::size_t k = 0; k < levels.size(); ++k) {
        const std::uint32_t level = static_cast<std::uint32_t>(levels[k]) + static_cast<std::uint32_t>(zero);
        good &= level <= top;
        store(k, quantizer.dequantize(static_cast<std::int32_t>(level)));
    }
    return good;
}

class RlpcaClip final : public DecodedClip {
 public:
    const ClipInfo& info() const override { return info_; }
    const std::vector<std::int32_t>& labels() const override { return segmentation_.labels; }

    Expected<void> decode(const ClipBitstream& clip, const MeshTopology& mesh, std::int32_t components,
                          std::int64_t size_limit_bytes, const Executor& executor);
    Expected<void> reconstruct(std::int64_t begin, MutablePositionsView out,
                               const Executor& executor) const override;

 private:
    Expected<void> decode_frames(std::span<const std::uint8_t> payload, const Executor& executor);
    Expected<void> decode_basis(std::span<const std::uint8_t> payload, std::int32_t components,
                                std::int64_t size_limit_bytes, const Executor& executor);
    Expected<void> decode_coefficients(std::span<const std::uint8_t> payload, std::int64_t size_limit_bytes,
                                       const Executor& executor);
    void reconstruct_block(std::int64_t begin, std::int64_t count, float* out) const;

    std::size_t cluster_count() const { return static_cast<std::size_t>(header_.cluster_count); }
    bool local() const { return header_.space == CoordinateSpace::kLocal; }
    std::int64_t stride() const { return (info_.frame_count + 15) / 16 * 16; }

    ClipInfo info_;
    RlpcaHeader header_;
    CodedSegmentation segmentation_;
    std::vector<ClusterTraversal> clusters_;
    std::vector<SeedTrianglePath> paths_;         // local space only
    std::vector<LocalFrameTrack> tracks_;         // one a cluster; one for all in world space
    std::vector<std::int64_t> coded_components_;  // in the stream
    std::vector<std::int64_t> used_components_;   // decoded of them
    std::vector<PackedBasis> bases_;
    std::vector<std::vector<float>> coefficients_;  // rows of stride() floats
};

Expected<void> RlpcaClip::decode(const ClipBitstream& clip, const MeshTopology& mesh, std::int32_t components,
                                 std::int64_t size_limit_bytes, const Executor& executor) {
    auto info = read_rlpca_info(clip);
    if (!info) return tl::unexpected(info.error());
    info_ = *info;
    auto header = RlpcaHeader::read(clip.payload(SectionId::kParameters), clip.vertex_count);
    if (!header) return fail_within(section_name(SectionId::kParameters), header.error());
    header_ = *header;
    // About what a vertex, and a frame of a cluster, take in the tables below; checked before any of them is
    // made.
    constexpr std::int64_t kBytesPerVertex = 64, kBytesPerFrame = 96;
    if (clip.vertex_count > size_limit_bytes / kBytesPerVertex ||
        clip.frame_count > size_limit_bytes / kBytesPerFrame / header_.cluster_count) {
        return fail(ErrorCode::kLimit,
                    "the clip needs more memory than allowed: " + std::to_string(clip.vertex_count) +
                        " vertices, " + std::to_string(clip.frame_count) + " frames");
    }
    const MeshAdjacency& adjacency = mesh.adjacency();
    auto segmentation =
        read_segmentation(clip.payload(SectionId::kSegmentation), clip.vertex_count, header_.cluster_count,
                          local() ? header_.cluster_count : 0, adjacency);
    if (!segmentation) return fail_within(section_name(SectionId::kSegmentation), segmentation.error());
    segmentation_ = std::move(*segmentation);
    clusters_ = RlpcaLayout(segmentation_.labels, segmentation_.seed_triangles, header_.cluster_count,
                            adjacency, executor)
                    .clusters;

    const auto in = [](SectionId section) {
        return
            [section](Error error) { return fail_within(section_name(section), std::move(error)).value(); };
    };
    return decode_frames(clip.payload(SectionId::kFrames), executor)
        .map_error(in(SectionId::kFrames))
        .and_then([&] {
            return decode_basis(clip.payload(SectionId::kBasis), components, size_limit_bytes, executor)
                .map_error(in(SectionId::kBasis));
        })
        .and_then([&] {
            return decode_coefficients(clip.payload(SectionId::kCoefficients), size_limit_bytes, executor)
                .map_error(in(SectionId::kCoefficients));
        });
}

Expected<void> RlpcaClip::decode_frames(std::span<const std::uint8_t> payload, const Executor& executor) {
    if (!local()) {
        if (!payload.empty()) return fail(ErrorCode::kCorrupt, "world space has no frames");
        tracks_.push_back(header_.world_track(info_.frame_count));
        return {};
    }
    auto paths = read_paths(payload, cluster_count(), info_.frame_count, header_.lattice.bits, executor);
    if (!paths) return tl::unexpected(paths.error());
    paths_ = std::move(*paths);
    tracks_.resize(cluster_count(), LocalFrameTrack(0));
    executor.for_each(header_.cluster_count, [&](std::int64_t i) {
        tracks_[static_cast<std::size_t>(i)] = paths_[static_cast<std::size_t>(i)].track(header_.lattice);
    });
    return {};
}

Expected<void> RlpcaClip::decode_basis(std::span<const std::uint8_t> payload, std::int32_t components,
                                       std::int64_t size_limit_bytes, const Executor& executor) {
    ByteReader reader(payload);
    std::vector<MinMaxQuantizer> quantizers(cluster_count());
    std::vector<std::int64_t> values(cluster_count());
    std::int64_t largest = 0, total = 0;
    coded_components_.resize(cluster_count());
    used_components_.resize(cluster_count());
    for (std::size_t i = 0; i < cluster_count(); ++i) {
        const std::int64_t rows = 3 * clusters_[i].size();
        const auto count = reader.get_varint(static_cast<std::uint64_t>(
            std::min({static_cast<std::int64_t>(header_.components), rows, info_.frame_count})));
        if (!count) return tl::unexpected(count.error());
        coded_components_[i] = static_cast<std::int64_t>(*count);
        used_components_[i] =
            components < 0 ? coded_components_[i] : std::min<std::int64_t>(components, coded_components_[i]);
        values[i] = rows * coded_components_[i];
        largest = std::max(largest, used_components_[i]);
        total += rows * used_components_[i];
        if (*count == 0) continue;
        const auto quantizer = read_quantizer(reader, header_.basis_bits);
        if (!quantizer) return tl::unexpected(quantizer.error());
        quantizers[i] = *quantizer;
    }
    if (total > size_limit_bytes / 8)
        return fail(ErrorCode::kLimit, std::to_string(total) + " basis values need more memory than allowed");
    const auto streams = deal_streams(values);
    const auto parts = split_streams(reader, streams, values);
    if (!parts) return tl::unexpected(parts.error());
    bases_.resize(cluster_count());
    return decode_streams(
        *parts, streams, components < 0, executor,
        [&](RangeDecoder& decoder, const std::vector<std::int32_t>& clusters) {
            ScaleContexts contexts;
            std::vector<std::int32_t> column;
            for (std::int64_t l = 0; l < largest; ++l) {
                for (const std::int32_t index : clusters) {
                    const auto i = static_cast<std::size_t>(index);
                    if (l >= used_components_[i]) continue;
                    if (l == 0) bases_[i] = PackedBasis(clusters_[i].size(), used_components_[i]);
                    if (!decode_column(decoder, contexts, clusters_[i], column)) return false;
                    float* packed = bases_[i].values.data() + bases_[i].index(0, l);
                    const std::int64_t skip = kPackedRows * (used_components_[i] - 1);
                    std::int64_t in_block = 0;
                    const bool good = dequantize_levels(
                        std::span(column).first(static_cast<std::size_t>(3 * clusters_[i].size())),
                        quantizers[i], header_.basis_bits, [&](std::size_t, float value) {
                            *packed++ = value;
                            if (++in_block == kPackedRows) {
                                in_block = 0;
                                packed += skip;
                            }
                        });
                    if (!good) return false;
                }
            }
            return true;
        });
}

Expected<void> RlpcaClip::decode_coefficients(std::span<const std::uint8_t> payload,
                                              std::int64_t size_limit_bytes, const Executor& executor) {
    ByteReader reader(payload);
    std::vector<MinMaxQuantizer> quantizers(cluster_count());
    std::vector<std::int64_t> values(cluster_count());
    std::int64_t largest = 0, total = 0;
    for (std::size_t i = 0; i < cluster_count(); ++i) {
        values[i] = coded_components_[i] * info_.frame_count;
        largest = std::max(largest, used_components_[i]);
        total += used_components_[i] * stride();
        if (coded_components_[i] == 0) continue;
        const auto quantizer = read_quantizer(reader, header_.coefficient_bits);
        if (!quantizer) return tl::unexpected(quantizer.error());
        quantizers[i] = *quantizer;
    }
    if (total > size_limit_bytes / 8)
        return fail(ErrorCode::kLimit, std::to_string(total) + " coefficients need more memory than allowed");
    const auto streams = deal_streams(values);
    const auto parts = split_streams(reader, streams, values);
    if (!parts) return tl::unexpected(parts.error());
    coefficients_.resize(cluster_count());
    return decode_streams(
        *parts, streams, used_components_ == coded_components_, executor,
        [&](RangeDecoder& decoder, const std::vector<std::int32_t>& clusters) {
            SeriesContexts contexts;
            std::vector<std::int32_t> series(static_cast<std::size_t>(info_.frame_count));
            for (std::int64_t l = 0; l < largest; ++l) {
                for (const std::int32_t index : clusters) {
                    const auto i = static_cast<std::size_t>(index);
                    if (l >= used_components_[i]) continue;
                    if (l == 0)
                        coefficients_[i].assign(static_cast<std::size_t>(used_components_[i] * stride()),
                                                0.0f);
                    if (!decode_series(decoder, contexts, series)) return false;
                    float* row = coefficients_[i].data() + l * stride();
                    if (!dequantize_levels(series, quantizers[i], header_.coefficient_bits,
                                           [&](std::size_t f, float value) { row[f] = value; }))
                        return false;
                }
            }
            return true;
        });
}

void RlpcaClip::reconstruct_block(std::int64_t begin, std::int64_t count, float* out) const {
    const std::int64_t frame_stride = 3 * info_.vertex_count;
    for (std::size_t i = 0; i < cluster_count(); ++i) {
        ClusterGeometry geometry;
        geometry.vertices = clusters_[i].vertices;
        geometry.basis = &bases_[i];
        geometry.coefficients = coefficients_[i].data();
        geometry.frame_track = tracks_[local() ? i : 0].values.data();
        geometry.stride = stride();
        reconstruct_cluster(geometry, begin, count, out, frame_stride);
    }
    if (local())
        write_corners(paths_, segmentation_.seed_triangles, header_.lattice, begin,
                      {out, count, info_.vertex_count});
}

Expected<void> RlpcaClip::reconstruct(std::int64_t begin, MutablePositionsView out,
                                      const Executor& executor) const {
    const std::int64_t end = begin + out.frame_count();
    if (auto good = check_frames(info_, begin, out); !good) return good;
    // Blocks begin at multiples of kFrameLanes; a range that does not is served through its first whole
    // block.
    const std::int64_t first_block = begin / kFrameLanes;
    const std::int64_t last_block = (end + kFrameLanes - 1) / kFrameLanes;
    executor.for_each(out.frame_count() == 0 ? 0 : last_block - first_block, [&](std::int64_t index) {
        const std::int64_t block = (first_block + index) * kFrameLanes;
        const std::int64_t count = std::min(kFrameLanes, end - block);
        if (block >= begin) {
            reconstruct_block(block, count, out.at(block - begin, 0));
            return;
        }
        std::vector<float> whole(static_cast<std::size_t>(count * 3 * info_.vertex_count));
        reconstruct_block(block, count, whole.data());
        std::copy(whole.begin() + (begin - block) * 3 * info_.vertex_count, whole.end(), out.data());
    });
    return {};
}

}  // namespace

Expected<ClipInfo> read_rlpca_info(const ClipBitstream& clip) {
    const auto header = RlpcaHeader::read(clip.payload(SectionId::kParameters), clip.vertex_count);
    if (!header) return fail_within(section_name(SectionId::kParameters), header.error());
    ClipInfo info = basic_info(clip);
    info.cluster_count = header->cluster_count;
    info.component_count = header->components;
    info.parameters.space = header->space;
    info.parameters.components = header->components;
    info.parameters.basis_bits = header->basis_bits;
    info.parameters.coefficient_bits = header->coefficient_bits;
    info.parameters.frame_bits = header->lattice.bits;
    return info;
}

Expected<std::unique_ptr<DecodedClip>> decode_rlpca(const ClipBitstream& clip, const MeshTopology& mesh,
                                                    std::int32_t components, std::int64_t size_limit_bytes,
                                                    const Executor& executor) {
    auto decoded = std::make_unique<RlpcaClip>();
    if (auto done = decoded->decode(clip, mesh, components, size_limit_bytes, executor); !done)
        return tl::unexpected(done.error());
    return decoded;
}

}  // namespace batchenc
