#include "codecs/rlpca_clusters.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "codecs/coded_segmentation.h"
#include "codecs/coded_streams.h"
#include "codecs/integer_contexts.h"
#include "kernels/bounding_box.h"
#include "kernels/byte_stream.h"
#include "kernels/svd.h"

namespace batchenc {
namespace {

/// Quantises `values` and gives levels relative to zero; replaces the values by what the decoder will have.
std::vector<std::int32_t> quantize_in_place(std::span<float> values, const MinMaxQuantizer& quantizer,
                                            int bits) {
    const std::int32_t zero = quantizer.zero_level(bits);
    std::vector<std::int32_t> levels(values.size());
    for (std::size_t i = 0; i < values.size(); ++i) {
        const std::int32_t level = quantizer.quantize(values[i], bits);
        levels[i] = level - zero;
        values[i] = quantizer.dequantize(level);
    }
    return levels;
}

tl::unexpected<Error> beyond_float32() {
    return fail(
        ErrorCode::kLimit,
        "its coordinates are too large or too small for float32 to carry their products; scale the clip");
}

/// Number of components up to the last one whose decoded coefficients are not all zero. The others are noise
/// below the quantiser's step: they would cost bits, and widen the range of the basis for nothing.
std::int64_t count_useful(const RowMajorMatrixXf& decoded, float step) {
    std::int64_t count = decoded.rows();
    while (count > 0 && (decoded.row(count - 1).array().abs() <= 0.5f * step).all()) --count;
    return count;
}

/// Calls code(cluster, component) for the clusters of one stream, components outermost, so that a decoder may
/// stop after any of them.
template <typename Code>
void for_each_component(const std::vector<CodedCluster>& coded, const std::vector<std::int32_t>& clusters,
                        Code code) {
    std::int64_t largest = 0;
    for (const std::int32_t i : clusters)
        largest = std::max(largest, coded[static_cast<std::size_t>(i)].component_count);
    for (std::int64_t l = 0; l < largest; ++l) {
        for (const std::int32_t i : clusters) {
            if (l < coded[static_cast<std::size_t>(i)].component_count)
                code(static_cast<std::size_t>(i), static_cast<std::size_t>(l));
        }
    }
}

/// Part `index` of `count` equal parts.
std::span<const std::int32_t> part_of(const std::vector<std::int32_t>& values, std::int64_t count,
                                      std::size_t index) {
    const std::size_t size = values.size() / static_cast<std::size_t>(count);
    return std::span(values).subspan(index * size, size);
}

/// Codes one component's basis column.
void encode_basis(RangeEncoder& encoder, ScaleContexts& contexts, const CodedCluster& cluster,
                  const ClusterTraversal& traversal, std::size_t component) {
    encode_column(encoder, contexts, traversal, part_of(cluster.basis, cluster.component_count, component));
}

/// Codes one component's coefficients.
void encode_coefficients(RangeEncoder& encoder, SeriesContexts& contexts, const CodedCluster& cluster,
                         std::size_t component, const SeriesForm& form = {},
                         std::span<const float> weights = {}) {
    const auto series = part_of(cluster.coefficients, cluster.component_count, component);
    if (form.fitted > 0)
        encode_fitted(encoder, contexts, weights, series);
    else
        encode_series(encoder, contexts, series, form.most_order);
}

/// Numbers of values of each cluster, by which they are dealt to streams.
std::vector<std::int64_t> value_counts(const std::vector<CodedCluster>& coded,
                                       std::vector<std::int32_t> CodedCluster::*levels) {
    std::vector<std::int64_t> counts;
    for (const CodedCluster& cluster : coded)
        counts.push_back(static_cast<std::int64_t>((cluster.*levels).size()));
    return counts;
}

Expected<RlpcaHeader> make_header(PositionsView positions, const CodecParameters& parameters,
                                  std::int32_t cluster_count) {
    const BoundingBox box = bounding_box(positions);
    RlpcaHeader header;
    header.space = parameters.space;
    header.basis_bits = parameters.basis_bits;
    header.coefficient_bits = parameters.coefficient_bits;
    header.lattice.bits = parameters.frame_bits;
    header.components = parameters.components;
    header.cluster_count = cluster_count;
    header.lattice.center = box.center();
    header.lattice.e_max = static_cast<float>(box.largest_side());
    if (!std::isfinite(header.lattice.e_max))
        return fail(ErrorCode::kLimit, "the bounding box is larger than float32 can say");
    return header;
}

}  // namespace

Expected<ColMajorMatrixXf> principal_components(const ColMajorMatrixXf& matrix, std::int64_t count) {
    if (matrix.size() == 0) return ColMajorMatrixXf(matrix.rows(), 0);
    auto svd = truncated_svd(matrix, count, choose_svd_method(matrix.rows(), matrix.cols(), count));
    if (!svd) return tl::unexpected(svd.error());
    return std::move(svd->basis);
}

Expected<CodedCluster> quantize_cluster(const ColMajorMatrixXf& matrix, ColMajorMatrixXf components,
                                        const RlpcaHeader& header) {
    CodedCluster coded;
    coded.component_count = components.cols();
    while (coded.component_count > 0) {  // ends: each turn but the last leaves fewer components
        ColMajorMatrixXf basis = components.leftCols(coded.component_count);
        const std::span<float> basis_values(basis.data(), static_cast<std::size_t>(basis.size()));
        coded.basis_quantizer = MinMaxQuantizer::of(basis_values, header.basis_bits);
        if (!coded.basis_quantizer.holds(basis_values, header.basis_bits)) return beyond_float32();
        coded.basis = quantize_in_place(basis_values, coded.basis_quantizer, header.basis_bits);
        // Coefficients against the decoded basis: what its quantisation has bent is made up for as far as it
        // can be.
        RowMajorMatrixXf coefficients = least_squares_coefficients(basis, matrix);
        const std::span<float> values(coefficients.data(), static_cast<std::size_t>(coefficients.size()));
        coded.coefficient_quantizer = MinMaxQuantizer::of(values, header.coefficient_bits);
        if (!coded.coefficient_quantizer.holds(values, header.coefficient_bits)) return beyond_float32();
        coded.coefficients = quantize_in_place(values, coded.coefficient_quantizer, header.coefficient_bits);
        const std::int64_t useful = count_useful(coefficients, coded.coefficient_quantizer.step);
        if (useful == coded.component_count) return coded;
        coded.component_count = useful;
    }
    return CodedCluster{};
}

std::vector<std::uint8_t> basis_section(const std::vector<CodedCluster>& coded, const RlpcaLayout& layout,
                                        const Executor& executor) {
    ByteWriter out;
    for (const CodedCluster& cluster : coded) {
        out.put_varint(static_cast<std::uint64_t>(cluster.component_count));
        if (cluster.component_count == 0) continue;
        out.put(cluster.basis_quantizer.low);
        out.put(cluster.basis_quantizer.step);
    }
    append_streams(out, deal_streams(value_counts(coded, &CodedCluster::basis)), executor,
                   [&](const std::vector<std::int32_t>& clusters) {
                       RangeEncoder encoder;
                       ScaleContexts contexts;
                       for_each_component(coded, clusters, [&](std::size_t i, std::size_t l) {
                           encode_basis(encoder, contexts, coded[i], layout.clusters[i], l);
                       });
                       return encoder.finish();
                   });
    return out.take();
}

std::vector<std::uint8_t> coefficients_section(const std::vector<CodedCluster>& coded, const SeriesForm& form,
                                               const Executor& executor) {
    ByteWriter out;
    std::vector<std::vector<float>> weights(coded.size());
    for (std::size_t i = 0; i < coded.size(); ++i) {
        if (coded[i].component_count == 0) continue;
        out.put(coded[i].coefficient_quantizer.low);
        out.put(coded[i].coefficient_quantizer.step);
        for (std::int64_t l = 0; l < coded[i].component_count && form.fitted > 0; ++l) {
            const auto fitted = fit_weights(
                part_of(coded[i].coefficients, coded[i].component_count, static_cast<std::size_t>(l)),
                form.fitted);
            weights[i].insert(weights[i].end(), fitted.begin(), fitted.end());
        }
        for (const float weight : weights[i]) out.put(weight);
    }
    append_streams(out, deal_streams(value_counts(coded, &CodedCluster::coefficients)), executor,
                   [&](const std::vector<std::int32_t>& clusters) {
                       RangeEncoder encoder;
                       SeriesContexts contexts;
                       for_each_component(coded, clusters, [&](std::size_t i, std::size_t l) {
                           const auto weights_of_l =
                               form.weights_of(weights[i], static_cast<std::int64_t>(l));
                           encode_coefficients(encoder, contexts, coded[i], l, form, weights_of_l);
                       });
                       return encoder.finish();
                   });
    return out.take();
}

std::vector<std::vector<double>> component_bits(const std::vector<CodedCluster>& coded,
                                                const RlpcaLayout& layout, const Executor& executor) {
    std::vector<std::vector<double>> bits;
    for (const CodedCluster& cluster : coded)
        bits.emplace_back(static_cast<std::size_t>(cluster.component_count));
    // Every component gets an encoder of its own, and the contexts go on from one to the next.
    const auto add = [&](std::vector<std::int32_t> CodedCluster::*levels, auto contexts_of, auto encode) {
        const Streams streams = deal_streams(value_counts(coded, levels));
        executor.for_each(static_cast<std::int64_t>(streams.size()), [&](std::int64_t s) {
            auto contexts = contexts_of();
            for_each_component(coded, streams[static_cast<std::size_t>(s)],
                               [&](std::size_t i, std::size_t l) {
                                   RangeEncoder encoder;
                                   encode(encoder, contexts, i, l);
                                   bits[i][l] += encoder.size_bits();
                               });
        });
    };
    add(
        &CodedCluster::basis, [] { return ScaleContexts(); },
        [&](RangeEncoder& encoder, ScaleContexts& contexts, std::size_t i, std::size_t l) {
            encode_basis(encoder, contexts, coded[i], layout.clusters[i], l);
        });
    add(
        &CodedCluster::coefficients, [] { return SeriesContexts(); },
        [&](RangeEncoder& encoder, SeriesContexts& contexts, std::size_t i, std::size_t l) {
            encode_coefficients(encoder, contexts, coded[i], l);
        });
    return bits;
}

Expected<RlpcaSource> RlpcaSource::of(PositionsView positions, const MeshTopology& mesh,
                                      const Segmentation& segmentation, const CodecParameters& parameters,
                                      const Executor& executor) {
    const std::int32_t cluster_count = segmentation.cluster_count();
    const auto header = make_header(positions, parameters, cluster_count);
    if (!header) return tl::unexpected(header.error());
    const bool local = header->space == CoordinateSpace::kLocal;
    const std::span<const Triangle> seed_triangles =
        local ? std::span<const Triangle>(segmentation.seed_triangles) : std::span<const Triangle>();
    const MeshAdjacency& adjacency = mesh.adjacency();
    RlpcaSource source(positions, *header,
                       RlpcaLayout(segmentation.labels, seed_triangles, cluster_count, adjacency, executor));
    source.paths_.resize(seed_triangles.size());
    executor.for_each(static_cast<std::int64_t>(seed_triangles.size()), [&](std::int64_t index) {
        const auto i = static_cast<std::size_t>(index);
        source.paths_[i] = SeedTrianglePath::of(positions, seed_triangles[i], header->lattice);
    });
    source.segmentation_section_ =
        write_segmentation(segmentation.labels, seed_triangles, cluster_count, adjacency);
    if (local) source.frames_section_ = write_paths(source.paths_, positions.frame_count(), executor);
    return source;
}

ColMajorMatrixXf RlpcaSource::local_coordinates(std::size_t cluster) const {
    const ClusterTraversal& traversal = layout_.clusters[cluster];
    const LocalFrameTrack track = paths_.empty() ? header_.world_track(positions_.frame_count())
                                                 : paths_[cluster].track(header_.lattice);
    ColMajorMatrixXf matrix(3 * traversal.size(), positions_.frame_count());
    for (std::int64_t f = 0; f < positions_.frame_count(); ++f)
        to_local(positions_.at(f, 0), traversal.vertices, track, f, matrix.col(f).data());
    return matrix;
}

std::vector<std::uint8_t> RlpcaSource::write(CodecMethod method, std::int32_t most_components,
                                             const std::vector<CodedCluster>& coded,
                                             const Executor& executor) const {
    RlpcaHeader header = header_;
    header.components = most_components;
    std::vector<SectionPayload> sections;
    sections.emplace_back(SectionId::kParameters, header.write());
    sections.emplace_back(SectionId::kSegmentation, segmentation_section_);
    sections.emplace_back(SectionId::kFrames, frames_section_);
    sections.emplace_back(SectionId::kBasis, basis_section(coded, layout_, executor));
    sections.emplace_back(SectionId::kCoefficients, coefficients_section(coded, {}, executor));
    return write_clip_bitstream(method, positions_.vertex_count(), positions_.frame_count(), sections);
}

}  // namespace batchenc
