#include "codecs/baselines/components.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "codecs/baselines/baselines.h"
#include "codecs/baselines/coded_motion.h"
#include "codecs/baselines/trajectory_clusters.h"
#include "codecs/coded_segmentation.h"
#include "codecs/component_clusters.h"
#include "codecs/field_coder.h"
#include "codecs/rlpca_clusters.h"
#include "codecs/rtpca_layout.h"
#include "kernels/svd.h"

namespace batchenc {
namespace {

bool is_clustered(CodecMethod method) { return method == CodecMethod::kBaselineCpca; }

/// What the sections that are shared with RLPCA are of.
RlpcaHeader component_header(const BaselineHeader& header) {
    RlpcaHeader shared;
    shared.space = CoordinateSpace::kWorld;
    shared.basis_bits = header.basis_bits;
    shared.coefficient_bits = header.coefficient_bits;
    shared.components = header.components;
    shared.cluster_count = std::max(header.cluster_count, 1);
    shared.lattice = {header.center, header.largest_side, 0};
    return shared;
}

/// baseline-pca has its coefficients as they are, baseline-pca-lpc predicts them, baseline-cpca as RLPCA.
SeriesForm series_form(CodecMethod method, const BaselineHeader& header) {
    switch (method) {
        case CodecMethod::kBaselinePca:
            return {0, 0};
        case CodecMethod::kBaselinePcaLpc:
            return {0, header.lpc_order};
        default:
            return {};
    }
}

// ---- the mean shape ----

/// Step of the mean shape, finer than the job's as an error there stands in every frame.
double mean_step(const BaselineHeader& header) { return header.step() / 4.0; }

/// Codes three fields in either direction. levels: V × 3, by vertex. False where the stream is seen to be
/// corrupt.
bool code_mean(BitCoder& coder, const FieldOrder& order, std::vector<std::int32_t>& levels) {
    FieldCoder fields;
    FieldMemory memory(order.size());
    std::vector<std::int32_t> field(order.vertices.size());
    for (std::size_t c = 0; c < 3; ++c) {
        const auto level = [&](std::size_t place) -> std::int32_t& {
            return levels[3 * static_cast<std::size_t>(order.vertices[place]) + c];
        };
        for (std::size_t place = 0; place < field.size(); ++place) field[place] = level(place);
        fields.code(coder, order, memory, FieldPredictor::kParallelogram, field);
        if (coder.is_overrun()) return false;
        for (std::size_t place = 0; place < field.size(); ++place) level(place) = field[place];
    }
    return true;
}

/// mean: V × 3, by vertex.
std::vector<std::uint8_t> write_mean(const FieldOrder& order, std::span<const double> mean, double step) {
    std::vector<std::int32_t> levels(mean.size(), 0);
    for (std::size_t k = 0; step > 0.0 && k < levels.size(); ++k)
        levels[k] = static_cast<std::int32_t>(std::lround(mean[k] / step));
    BitCoder coder;
    code_mean(coder, order, levels);
    return coder.finish();
}

/// V × 3 values, by vertex. Error: kCorrupt.
Expected<std::vector<float>> read_mean(std::span<const std::uint8_t> bytes, const FieldOrder& order,
                                       double step) {
    std::vector<std::int32_t> levels(3 * order.vertices.size(), 0);
    BitCoder coder(bytes);
    if (!code_mean(coder, order, levels)) return fail(ErrorCode::kCorrupt, "the mean shape does not decode");
    if (auto end = coder.check_end(); !end) return tl::unexpected(end.error());
    std::vector<float> mean;
    for (const std::int32_t level : levels)
        mean.push_back(static_cast<float>(static_cast<double>(level) * step));
    return mean;
}

// ---- encoding ----

/// The components that are of some account: a component that moves coordinates by less than a
/// sixteenth of the job's step in root mean square is what rounding left, as of bodies that do not
/// deform.
Expected<ColMajorMatrixXf> components_of_account(const ColMajorMatrixXf& shapes, std::int64_t count,
                                                 double step) {
    auto svd = truncated_svd(shapes, count, choose_svd_method(shapes.rows(), shapes.cols(), count));
    if (!svd) return tl::unexpected(svd.error());
    const double least = step / 16.0 * std::sqrt(static_cast<double>(shapes.size()));
    Eigen::Index kept = svd->basis.cols();
    while (kept > 0 && static_cast<double>(svd->singular_values(kept - 1)) < least) --kept;
    return ColMajorMatrixXf(svd->basis.leftCols(kept));
}

/// Codes one cluster's shapes about their mean over time, which is put where its vertices stand in `mean`.
Expected<CodedCluster> encode_cluster(PositionsView positions, const ClusterTraversal& traversal,
                                      const LocalFrameTrack& track, const BaselineHeader& header,
                                      std::span<double> mean) {
    ColMajorMatrixXf shapes(3 * traversal.size(), positions.frame_count());
    for (std::int64_t f = 0; f < positions.frame_count(); ++f)
        to_local(positions.at(f, 0), traversal.vertices, track, f, shapes.col(f).data());
    if (!shapes.allFinite())
        return fail(ErrorCode::kLimit, "its coordinates are too large for float32 to carry their products");
    const Eigen::VectorXd own_mean = shapes.cast<double>().rowwise().mean();
    shapes.colwise() -= own_mean.cast<float>();
    for (std::size_t k = 0; k < 3 * traversal.vertices.size(); ++k)
        mean[3 * static_cast<std::size_t>(traversal.vertices[k / 3]) + k % 3] =
            own_mean(static_cast<Eigen::Index>(k));
    auto components = components_of_account(shapes, header.components, header.step());
    if (!components) return tl::unexpected(components.error());
    return quantize_cluster(shapes, std::move(*components), component_header(header));
}

/// What is coded around the components: which vertices belong together, and how they move.
struct Setting {
    std::vector<std::int32_t> labels;
    LocalFrameTrack track{0};
    std::vector<std::uint8_t> segmentation_section, frames_section;
};

Setting whole_setting(PositionsView positions, const BaselineHeader& header) {
    CodedMotion motion(header.center, header.largest_side);
    motion.set_best(positions);
    const std::vector<std::int32_t> labels(static_cast<std::size_t>(positions.vertex_count()), 0);
    return {labels, motion.track(), {}, motion.write()};
}

/// Sets the number of clusters in the header.
Expected<Setting> clustered_setting(PositionsView positions, const MeshTopology& mesh,
                                    const Segmentation& segmentation, BaselineHeader& header,
                                    const Executor& executor) {
    auto clusters = TrajectoryClusters::of(positions, segmentation.labels, segmentation.cluster_count(),
                                           header.components, executor);
    if (!clusters) return tl::unexpected(clusters.error());
    header.cluster_count = clusters->count;
    auto section = write_segmentation(clusters->labels, {}, clusters->count, mesh.adjacency());
    return Setting{std::move(clusters->labels),
                   component_header(header).world_track(positions.frame_count()),
                   std::move(section),
                   {}};
}

// ---- decoding ----

class ComponentClip final : public DecodedClip {
 public:
    explicit ComponentClip(const ClipInfo& info) : info_(info) {}

    const ClipInfo& info() const override { return info_; }
    const std::vector<std::int32_t>& labels() const override { return labels_; }

    Expected<void> decode(const ClipBitstream& clip, const MeshTopology& mesh, std::int32_t components,
                          std::int64_t size_limit_bytes, const Executor& executor);
    Expected<void> reconstruct(std::int64_t begin, MutablePositionsView out,
                               const Executor& executor) const override {
        if (auto good = check_frames(info_, begin, out); !good) return good;
        reconstruct_in_blocks(begin, out, executor, [this](std::int64_t block, MutablePositionsView frames) {
            for (std::size_t i = 0; i < clusters_.size(); ++i)
                clusters_.reconstruct(i, track_, block, frames);
        });
        return {};
    }

 private:
    Expected<void> decode_labels(std::span<const std::uint8_t> payload, const MeshTopology& mesh,
                                 std::int32_t cluster_count);
    Expected<void> decode_track(std::span<const std::uint8_t> payload, const BaselineHeader& header);

    ClipInfo info_;
    std::vector<std::int32_t> labels_;  // of baseline-cpca
    ComponentClusters clusters_;
    LocalFrameTrack track_{0};  // of all clusters
};

Expected<void> ComponentClip::decode_labels(std::span<const std::uint8_t> payload, const MeshTopology& mesh,
                                            std::int32_t cluster_count) {
    if (!is_clustered(info_.method)) {
        if (payload.empty() && cluster_count == 0) return {};
        return fail(ErrorCode::kCorrupt, "there are no clusters");
    }
    if (cluster_count < 1 || cluster_count > info_.vertex_count)
        return fail(ErrorCode::kCorrupt, "the number of clusters makes no sense");
    auto segmentation = read_segmentation(payload, info_.vertex_count, cluster_count, 0, mesh.adjacency());
    if (!segmentation) return tl::unexpected(segmentation.error());
    labels_ = std::move(segmentation->labels);
    return {};
}

Expected<void> ComponentClip::decode_track(std::span<const std::uint8_t> payload,
                                           const BaselineHeader& header) {
    if (is_clustered(info_.method)) {
        track_ = component_header(header).world_track(info_.frame_count);
        if (!payload.empty()) return fail(ErrorCode::kCorrupt, "clusters have no motion");
        return {};
    }
    CodedMotion motion(header.center, header.largest_side);
    if (auto done = motion.read(payload, info_.frame_count); !done) return done;
    track_ = motion.track();
    return {};
}

Expected<void> ComponentClip::decode(const ClipBitstream& clip, const MeshTopology& mesh,
                                     std::int32_t components, std::int64_t size_limit_bytes,
                                     const Executor& executor) {
    const auto header = BaselineHeader::read(clip.payload(SectionId::kParameters));
    if (!header) return fail_within(section_name(SectionId::kParameters), header.error());
    const RlpcaHeader shared = component_header(*header);
    // What a vertex, and a frame of a cluster, take in tables, checked before any of them is made.
    constexpr std::int64_t kBytesPerVertex = 128, kBytesPerFrame = 128;
    if (clip.vertex_count > size_limit_bytes / kBytesPerVertex ||
        clip.frame_count > size_limit_bytes / kBytesPerFrame / shared.cluster_count)
        return fail(ErrorCode::kLimit, "the clip needs more memory than allowed");
    const auto within = [](SectionId id, const Error& error) { return fail_within(section_name(id), error); };
    if (auto done = decode_labels(clip.payload(SectionId::kSegmentation), mesh, header->cluster_count); !done)
        return within(SectionId::kSegmentation, done.error());
    if (auto done = decode_track(clip.payload(SectionId::kFrames), *header); !done)
        return within(SectionId::kFrames, done.error());

    const std::vector<std::int32_t> one_cluster(
        labels_.empty() ? static_cast<std::size_t>(clip.vertex_count) : 0, 0);
    RlpcaLayout layout(labels_.empty() ? one_cluster : labels_, {}, shared.cluster_count, mesh.adjacency(),
                       executor);
    clusters_ = ComponentClusters(std::move(layout.clusters), clip.frame_count, shared, 1);
    const auto basis = split_parts(clip.payload(SectionId::kBasis), 2);
    if (!basis) return within(SectionId::kBasis, basis.error());
    const auto mean = read_mean((*basis)[0], mesh.field_order(), mean_step(*header));
    if (!mean) return within(SectionId::kBasis, mean.error());
    if (auto done = clusters_.read_basis((*basis)[1], components, size_limit_bytes, executor); !done)
        return within(SectionId::kBasis, done.error());
    if (auto done =
            clusters_.read_coefficients(clip.payload(SectionId::kCoefficients),
                                        series_form(info_.method, *header), size_limit_bytes, executor);
        !done)
        return within(SectionId::kCoefficients, done.error());
    for (std::size_t i = 0; i < clusters_.size(); ++i) {
        std::vector<float> own_mean;
        for (const std::int32_t v : clusters_.traversal(i).vertices) {
            const float* place = mean->data() + 3 * static_cast<std::size_t>(v);
            own_mean.insert(own_mean.end(), place, place + 3);
        }
        clusters_.set_given(i, 0, own_mean);
    }
    return {};
}

}  // namespace

Expected<EncodedClip> encode_component_baseline(PositionsView positions, const MeshTopology& mesh,
                                                const Segmentation& segmentation,
                                                const CodecParameters& parameters, BaselineHeader header,
                                                const Executor& executor) {
    header.components = parameters.components;
    auto setting = is_clustered(parameters.method)
                       ? clustered_setting(positions, mesh, segmentation, header, executor)
                       : whole_setting(positions, header);
    if (!setting) return tl::unexpected(setting.error());
    const std::int32_t cluster_count = std::max(header.cluster_count, 1);
    const RlpcaLayout layout(setting->labels, {}, cluster_count, mesh.adjacency(), executor);
    std::vector<double> mean(3 * setting->labels.size());
    std::vector<CodedCluster> coded(layout.clusters.size());
    const auto done = for_each_cluster(cluster_count, executor, [&](std::size_t i) -> Expected<void> {
        auto cluster = encode_cluster(positions, layout.clusters[i], setting->track, header, mean);
        if (!cluster) return tl::unexpected(cluster.error());
        coded[i] = std::move(*cluster);
        return {};
    });
    if (!done) return tl::unexpected(done.error());
    ByteWriter basis;
    append_parts(basis, std::vector{write_mean(mesh.field_order(), mean, mean_step(header)),
                                    basis_section(coded, layout, executor)});
    std::vector<SectionPayload> sections;
    sections.emplace_back(SectionId::kParameters, header.write());
    sections.emplace_back(SectionId::kSegmentation, std::move(setting->segmentation_section));
    sections.emplace_back(SectionId::kFrames, std::move(setting->frames_section));
    sections.emplace_back(SectionId::kBasis, basis.take());
    sections.emplace_back(SectionId::kCoefficients,
                          coefficients_section(coded, series_form(parameters.method, header), executor));
    EncodedClip clip;
    clip.bitstream =
        write_clip_bitstream(parameters.method, positions.vertex_count(), positions.frame_count(), sections);
    return clip;
}

Expected<std::unique_ptr<DecodedClip>> decode_component_baseline(const ClipBitstream& clip,
                                                                 const SharedMesh& mesh,
                                                                 std::int32_t components,
                                                                 std::int64_t size_limit_bytes,
                                                                 const Executor& executor) {
    const auto info = read_baseline_info(clip);
    if (!info) return tl::unexpected(info.error());
    auto decoded = std::make_unique<ComponentClip>(*info);
    if (auto done = decoded->decode(clip, *mesh, components, size_limit_bytes, executor); !done)
        return tl::unexpected(done.error());
    return decoded;
}

}  // namespace batchenc
