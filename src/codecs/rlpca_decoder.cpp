#include "codecs/coded_segmentation.h"
#include "codecs/component_clusters.h"
#include "codecs/rlpca.h"
#include "codecs/rlpca_layout.h"

namespace batchenc {
namespace {

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
    void reconstruct_block(std::int64_t begin, MutablePositionsView out) const;

    std::size_t cluster_count() const { return static_cast<std::size_t>(header_.cluster_count); }
    bool local() const { return header_.space == CoordinateSpace::kLocal; }

    ClipInfo info_;
    RlpcaHeader header_;
    CodedSegmentation segmentation_;
    ComponentClusters clusters_;
    std::vector<SeedTrianglePath> paths_;  // local space only
    std::vector<LocalFrameTrack> tracks_;  // one a cluster; one for all in world space
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
    RlpcaLayout layout(segmentation_.labels, segmentation_.seed_triangles, header_.cluster_count, adjacency,
                       executor);
    clusters_ = ComponentClusters(std::move(layout.clusters), clip.frame_count, header_);

    const auto in = [](SectionId section) {
        return
            [section](Error error) { return fail_within(section_name(section), std::move(error)).value(); };
    };
    return decode_frames(clip.payload(SectionId::kFrames), executor)
        .map_error(in(SectionId::kFrames))
        .and_then([&] {
            return clusters_
                .read_basis(clip.payload(SectionId::kBasis), components, size_limit_bytes, executor)
                .map_error(in(SectionId::kBasis));
        })
        .and_then([&] {
            return clusters_
                .read_coefficients(clip.payload(SectionId::kCoefficients), {}, size_limit_bytes, executor)
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

void RlpcaClip::reconstruct_block(std::int64_t begin, MutablePositionsView out) const {
    for (std::size_t i = 0; i < clusters_.size(); ++i)
        clusters_.reconstruct(i, tracks_[local() ? i : 0], begin, out);
    if (local()) write_corners(paths_, segmentation_.seed_triangles, header_.lattice, begin, out);
}

Expected<void> RlpcaClip::reconstruct(std::int64_t begin, MutablePositionsView out,
                                      const Executor& executor) const {
    if (auto good = check_frames(info_, begin, out); !good) return good;
    reconstruct_in_blocks(begin, out, executor, [this](std::int64_t block, MutablePositionsView frames) {
        reconstruct_block(block, frames);
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
