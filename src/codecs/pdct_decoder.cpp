#include <algorithm>
#include <array>
#include <optional>

#include "codecs/coded_streams.h"
#include "codecs/level_rows.h"
#include "codecs/pdct.h"
#include "codecs/pdct_layout.h"
#include "codecs/static_coder.h"
#include "kernels/byte_stream.h"
#include "kernels/predecessor_prediction.h"
#include "kernels/signal_order.h"
#include "kernels/temporal_series.h"

namespace batchenc {
namespace {

tl::unexpected<Error> corrupt(const char* message) { return fail(ErrorCode::kCorrupt, message); }

class PdctClip final : public DecodedClip {
 public:
    const ClipInfo& info() const override { return info_; }
    const std::vector<std::int32_t>& labels() const override { return segmentation_.labels; }

    Expected<void> decode(const ClipBitstream& clip, const SharedMesh& mesh, std::int64_t size_limit_bytes,
                          const Executor& executor);
    Expected<void> reconstruct(std::int64_t begin, MutablePositionsView out,
                               const Executor& executor) const override;

 private:
    struct Cluster {
        ClusterTraversal traversal;
        std::optional<ClusterTransform> transform;  // none without vertices
        std::vector<float> base;                    // 3n: local coordinates of the first frame
        std::unique_ptr<std::int32_t[]> levels;     // F - 1 rows of 3n, whole
        bool over_mesh = false;

        std::int64_t columns() const { return transform ? transform->columns() : 0; }
        std::size_t row_size() const { return static_cast<std::size_t>(3 * columns()); }
        std::span<std::int32_t> row(std::int64_t r) const {
            return {levels.get() + static_cast<std::size_t>(r) * row_size(), row_size()};
        }
    };

    Expected<void> decode_levels(std::span<const std::uint8_t> payload, const ClusterMembers& in,
                                 bool is_points, const Executor& executor);
    bool decode_stream(RangeDecoder& decoder, const std::vector<std::int32_t>& clusters, bool is_points);
    /// Reads the first frame of a cluster of points, and orders them by it.
    bool decode_points(RangeDecoder& decoder, RowContexts& contexts, Cluster& cluster,
                       std::span<std::int32_t> row) const;
    /// Frames of one group, as far as they are in [begin, begin + out.frame_count()).
    void reconstruct_group(const Cluster& cluster, const LocalFrameTrack& track, std::int64_t group,
                           std::int64_t begin, MutablePositionsView out) const;

    std::int64_t rows() const { return info_.frame_count - 1; }
    /// Rows that are transformed together: whole blocks, and whole lanes.
    std::int64_t group_rows() const {
        return std::max<std::int64_t>(1, kDctLanes / header_.block) * header_.block;
    }

    ClipInfo info_;
    PdctHeader header_;
    CodedSegmentation segmentation_;
    std::vector<SeedTrianglePath> paths_;
    std::vector<LocalFrameTrack> tracks_;
    std::vector<Cluster> clusters_;
    std::vector<float> first_frame_;  // V x 3
};

Expected<void> PdctClip::decode(const ClipBitstream& clip, const SharedMesh& mesh,
                                std::int64_t size_limit_bytes, const Executor& executor) {
    auto info = read_pdct_info(clip);
    if (!info) return tl::unexpected(info.error());
    info_ = *info;
    header_ = *PdctHeader::read(clip.payload(SectionId::kParameters), clip.vertex_count);
    // About what a vertex, a frame of a cluster, and a vertex in a frame (levels and what contexts remember)
    // take; checked before any is allocated.
    constexpr std::int64_t kBytesPerVertex = 640, kBytesPerFrame = 96, kBytesPerSample = 24;
    if (clip.vertex_count > size_limit_bytes / kBytesPerVertex ||
        std::max<std::int64_t>(clip.frame_count, header_.block) >
            size_limit_bytes / kBytesPerFrame / header_.cluster_count ||
        clip.frame_count > size_limit_bytes / kBytesPerSample / clip.vertex_count) {
        return fail(ErrorCode::kLimit,
                    "the clip needs more memory than allowed: " + std::to_string(clip.vertex_count) +
                        " vertices, " + std::to_string(clip.frame_count) + " frames");
    }
    const MeshAdjacency& adjacency = mesh->adjacency();
    auto segmentation = read_segmentation(clip.payload(SectionId::kSegmentation), clip.vertex_count,
                                          header_.cluster_count, header_.cluster_count, adjacency);
    if (!segmentation) return fail_within(section_name(SectionId::kSegmentation), segmentation.error());
    segmentation_ = std::move(*segmentation);
    const std::size_t cluster_count = segmentation_.seed_triangles.size();
    auto paths = read_paths(clip.payload(SectionId::kFrames), cluster_count, clip.frame_count,
                            header_.lattice.bits, executor);
    if (!paths) return fail_within(section_name(SectionId::kFrames), paths.error());
    paths_ = std::move(*paths);
    tracks_.resize(cluster_count, LocalFrameTrack(0));
    const bool is_points = mesh->is_points();
    first_frame_.resize(static_cast<std::size_t>(3 * clip.vertex_count));
    if (!is_points) {
        const auto frame = decode_static_frame(clip.payload(SectionId::kResiduals), *mesh, size_limit_bytes,
                                               {first_frame_.data(), 1, clip.vertex_count}, executor);
        if (!frame) return fail_within(section_name(SectionId::kResiduals), frame.error());
    } else if (!clip.payload(SectionId::kResiduals).empty()) {
        return corrupt("points have no static frame");
    }

    const ClusterMembers in(segmentation_.labels, segmentation_.seed_triangles, header_.cluster_count);
    clusters_.resize(cluster_count);
    std::vector<std::int32_t> position(static_cast<std::size_t>(clip.vertex_count), -1);
    executor.for_each(header_.cluster_count, [&](std::int64_t index) {
        const auto i = static_cast<std::size_t>(index);
        tracks_[i] = paths_[i].track(header_.lattice);
        Cluster& cluster = clusters_[i];
        if (in.members[i].empty()) return;
        const std::size_t size = 3 * in.members[i].size();
        cluster.transform.emplace(static_cast<std::int64_t>(in.members[i].size()), header_.block);
        cluster.base.assign(static_cast<std::size_t>(cluster.transform->stride()), 0.0f);
        cluster.levels =
            std::make_unique_for_overwrite<std::int32_t[]>(size * static_cast<std::size_t>(rows()));
        if (is_points) return;  // their order comes with the levels
        cluster.traversal =
            walk_cluster(adjacency, in.members[i], in.owner, static_cast<std::int32_t>(i), position);
        to_local(first_frame_.data(), cluster.traversal.vertices, tracks_[i], 0, cluster.base.data());
    });
    if (auto done = decode_levels(clip.payload(SectionId::kCoefficients), in, is_points, executor); !done)
        return fail_within(section_name(SectionId::kCoefficients), done.error());
    for (std::size_t i = 0; i < cluster_count && is_points; ++i)
        to_world(clusters_[i].base.data(), clusters_[i].traversal.vertices, tracks_[i], 0,
                 first_frame_.data());
    return {};
}

Expected<void> PdctClip::decode_levels(std::span<const std::uint8_t> payload, const ClusterMembers& in,
                                       bool is_points, const Executor& executor) {
    ByteReader reader(payload);
    const auto flags = reader.get_bytes((clusters_.size() + 7) / 8);
    if (!flags) return tl::unexpected(flags.error());
    for (std::size_t i = 0; i < clusters_.size(); ++i) clusters_[i].over_mesh = (*flags)[i / 8] >> i % 8 & 1;
    std::vector<std::int64_t> values, row_counts;
    for (std::size_t i = 0; i < clusters_.size(); ++i) {
        const auto columns = static_cast<std::int64_t>(in.members[i].size());
        values.push_back(3 * columns * info_.frame_count);
        row_counts.push_back(columns == 0 ? 0 : rows());  // each row costs a symbol
        if (is_points) clusters_[i].traversal.vertices = in.members[i];
    }
    const Streams streams = deal_streams(values, kLevelsPerStream);
    const auto parts = split_streams(reader, streams, row_counts);
    if (!parts) return tl::unexpected(parts.error());
    return decode_streams(*parts, streams, true, executor, [&](RangeDecoder& decoder, const auto& clusters) {
        return decode_stream(decoder, clusters, is_points);
    });
}

bool PdctClip::decode_points(RangeDecoder& decoder, RowContexts& contexts, Cluster& cluster,
                             std::span<std::int32_t> row) const {
    RowMemory nothing(cluster.columns(), 1);
    if (!decode_row(decoder, contexts, nothing, 0, row)) return false;
    for (std::size_t j = 0; j < row.size(); ++j)
        cluster.base[j] = static_cast<float>(row[j]) * header_.intra_step();
    std::vector<float> workspace(static_cast<std::size_t>(cluster.transform->workspace_size()));
    cluster.transform->inverse_space(cluster.base.data(), 1, workspace.data());
    const std::vector<std::int32_t> members = std::move(cluster.traversal.vertices);
    cluster.traversal = order_points(members, std::span(cluster.base).first(row.size()));
    return true;
}

/// Adds what a row was predicted to be over the mesh; false for a level that no encoder writes. padded: of at
/// least four values more than the row.
bool add_prediction(const ClusterTraversal& traversal, std::span<std::int32_t> row,
                    std::vector<std::int32_t>& padded) {
    std::fill_n(padded.begin(), row.size() + 4, 0);
    std::array<std::int32_t, 4> predicted{};
    for (std::size_t v = 0; v < row.size() / 3; ++v) {
        predict_from_predecessors(traversal, padded.data(), v, predicted.data());
        for (std::size_t c = 0; c < 3; ++c) {
            const std::int32_t level = wrapping_sum(predicted[c], row[3 * v + c]);
            if (level > kLargestPredictable || level < -kLargestPredictable) return false;
            padded[3 * v + c] = level;
        }
    }
    std::copy_n(padded.begin(), row.size(), row.begin());
    return true;
}

bool PdctClip::decode_stream(RangeDecoder& decoder, const std::vector<std::int32_t>& clusters,
                             bool is_points) {
    RowContexts contexts;
    std::vector<RowMemory> memories;
    std::size_t largest = 0;
    for (const std::int32_t i : clusters) {
        const Cluster& cluster = clusters_[static_cast<std::size_t>(i)];
        memories.emplace_back(cluster.columns(), std::clamp<std::int64_t>(rows(), 1, header_.block));
        largest = std::max(largest, cluster.row_size());
    }
    std::vector<std::int32_t> padded(largest + 4);
    for (const std::int32_t i : clusters) {
        Cluster& cluster = clusters_[static_cast<std::size_t>(i)];
        const std::span<std::int32_t> row = std::span(padded).first(cluster.row_size());
        if (is_points && cluster.transform && !decode_points(decoder, contexts, cluster, row)) return false;
    }
    std::int64_t length_before = header_.block;
    for (std::int64_t first = 0; first < rows(); first += header_.block) {
        const std::int64_t length = std::min<std::int64_t>(header_.block, rows() - first);
        for (std::size_t k = 0; k < clusters.size(); ++k) {
            Cluster& cluster = clusters_[static_cast<std::size_t>(clusters[k])];
            if (!cluster.transform) continue;
            const std::size_t size = cluster.row_size();
            for (std::int64_t t = 0; t < length; ++t) {
                const std::span<std::int32_t> levels = cluster.row(first + t);
                if (!decode_row(decoder, contexts, memories[k], static_cast<std::size_t>(t), levels))
                    return false;
                if (cluster.over_mesh && !add_prediction(cluster.traversal, levels, padded)) return false;
                if (t > 0 || first == 0) continue;
                const std::int32_t* before = levels.data() - static_cast<std::size_t>(length_before) * size;
                for (std::size_t j = 0; j < size; ++j)
                    levels[j] = wrapping_sum(levels[j], predict_block(before[j], length_before, length));
            }
        }
        length_before = length;
    }
    return true;
}

void PdctClip::reconstruct_group(const Cluster& cluster, const LocalFrameTrack& track, std::int64_t group,
                                 std::int64_t begin, MutablePositionsView out) const {
    const ClusterTransform& transform = *cluster.transform;
    const std::int64_t first = group * group_rows();  // frame first + 1
    const std::int64_t count = std::min(group_rows(), rows() - first);
    const std::size_t size = cluster.row_size();
    const float step = header_.step();
    std::vector<float> workspace(static_cast<std::size_t>(transform.workspace_size()));
    const auto values =
        std::make_unique_for_overwrite<float[]>(static_cast<std::size_t>(count * transform.stride()));
    for (std::int64_t r = 0; r < count; ++r) {
        const std::span<const std::int32_t> levels = cluster.row(first + r);
        float* row = values.get() + r * transform.stride();
        for (std::size_t j = 0; j < size; ++j) row[j] = static_cast<float>(levels[j]) * step;
        std::fill(row + size, row + transform.stride(), 0.0f);
    }
    if (!cluster.over_mesh) transform.inverse_space(values.get(), count, workspace.data());
    for (std::int64_t r = 0; r < count; r += header_.block)
        transform.inverse_time(values.get() + r * transform.stride(),
                               std::min<std::int64_t>(header_.block, count - r), workspace.data());
    for (std::int64_t r = 0; r < count; ++r) {
        const std::int64_t frame = first + 1 + r;
        if (frame < begin || frame >= begin + out.frame_count()) continue;
        float* row = values.get() + r * transform.stride();
        for (std::size_t j = 0; j < size; ++j) row[j] += cluster.base[j];
        to_world(row, cluster.traversal.vertices, track, frame, out.at(frame - begin, 0));
    }
}

Expected<void> PdctClip::reconstruct(std::int64_t begin, MutablePositionsView out,
                                     const Executor& executor) const {
    if (auto good = check_frames(info_, begin, out); !good) return good;
    if (out.frame_count() == 0) return {};
    const std::int64_t end = begin + out.frame_count();
    if (begin == 0) std::copy(first_frame_.begin(), first_frame_.end(), out.data());
    if (end > 1) {
        const std::int64_t first_group = (std::max<std::int64_t>(begin, 1) - 1) / group_rows();
        const std::int64_t group_count = (end - 2) / group_rows() + 1 - first_group;
        const auto cluster_count = static_cast<std::int64_t>(clusters_.size());
        executor.for_each(group_count * cluster_count, [&](std::int64_t task) {
            const auto i = static_cast<std::size_t>(task % cluster_count);
            if (clusters_[i].transform)
                reconstruct_group(clusters_[i], tracks_[i], first_group + task / cluster_count, begin, out);
        });
    }
    write_corners(paths_, segmentation_.seed_triangles, header_.lattice, begin, out);
    return {};
}

}  // namespace

Expected<ClipInfo> read_pdct_info(const ClipBitstream& clip) {
    const auto header = PdctHeader::read(clip.payload(SectionId::kParameters), clip.vertex_count);
    if (!header) return fail_within(section_name(SectionId::kParameters), header.error());
    ClipInfo info = basic_info(clip);
    info.cluster_count = header->cluster_count;
    info.parameters.bits = header->bits;
    info.parameters.intra_bits = header->intra_bits;
    info.parameters.frame_bits = header->lattice.bits;
    info.parameters.transform = header->block == 1 ? PdctTransform::kSpatial : PdctTransform::kTemporal;
    if (header->block > 1) info.parameters.block = header->block;
    return info;
}

Expected<std::unique_ptr<DecodedClip>> decode_pdct(const ClipBitstream& clip, const SharedMesh& mesh,
                                                   std::int64_t size_limit_bytes, const Executor& executor) {
    auto decoded = std::make_unique<PdctClip>();
    if (auto done = decoded->decode(clip, mesh, size_limit_bytes, executor); !done)
        return tl::unexpected(done.error());
    return decoded;
}

}  // namespace batchenc
