#include <algorithm>
#include <cmath>
#include <optional>

#include "codecs/coded_segmentation.h"
#include "codecs/coded_streams.h"
#include "codecs/integer_contexts.h"
#include "codecs/rlpca.h"
#include "codecs/rlpca_layout.h"
#include "kernels/bounding_box.h"
#include "kernels/byte_stream.h"
#include "kernels/quantizer.h"
#include "kernels/svd.h"

namespace batchenc {
namespace {

/// One cluster as integers, ready to be coded.
struct CodedCluster {
    std::int64_t component_count = 0;  // L of this cluster
    MinMaxQuantizer basis_quantizer, coefficient_quantizer;
    std::vector<std::int32_t> basis;         // L columns of 3n levels, relative to the level of zero
    std::vector<std::int32_t> coefficients;  // L rows of F levels, likewise
};

/// A_i: coordinates of a cluster's vertices, 3n × F, in the frames of its track.
ColMajorMatrixXf local_coordinates(PositionsView positions, const ClusterTraversal& cluster,
                                   const LocalFrameTrack& track) {
    ColMajorMatrixXf matrix(3 * cluster.size(), positions.frame_count());
    for (std::int64_t f = 0; f < positions.frame_count(); ++f)
        to_local(positions.at(f, 0), cluster.vertices, track, f, matrix.col(f).data());
    return matrix;
}

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

Expected<CodedCluster> code_cluster(const ColMajorMatrixXf& matrix, const RlpcaHeader& header) {
    CodedCluster coded;
    if (matrix.size() == 0) return coded;
    const SvdMethod method = choose_svd_method(matrix.rows(), matrix.cols(), header.components);
    const auto svd = truncated_svd(matrix, header.components, method);
    if (!svd) return tl::unexpected(svd.error());
    coded.component_count = svd->basis.cols();
    while (coded.component_count > 0) {  // ends: each turn but the last leaves fewer components
        ColMajorMatrixXf basis = svd->basis.leftCols(coded.component_count);
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

std::vector<std::uint8_t> basis_section(const std::vector<CodedCluster>& coded, const RlpcaLayout& layout,
                                        const Executor& executor) {
    ByteWriter out;
    std::vector<std::int64_t> values;
    for (const CodedCluster& cluster : coded) {
        values.push_back(static_cast<std::int64_t>(cluster.basis.size()));
        out.put_varint(static_cast<std::uint64_t>(cluster.component_count));
        if (cluster.component_count == 0) continue;
        out.put(cluster.basis_quantizer.low);
        out.put(cluster.basis_quantizer.step);
    }
    append_streams(out, deal_streams(values), executor, [&](const std::vector<std::int32_t>& clusters) {
        RangeEncoder encoder;
        ScaleContexts contexts;
        for_each_component(coded, clusters, [&](std::size_t i, std::size_t l) {
            encode_column(encoder, contexts, layout.clusters[i],
                          part_of(coded[i].basis, coded[i].component_count, l));
        });
        return encoder.finish();
    });
    return out.take();
}

std::vector<std::uint8_t> coefficients_section(const std::vector<CodedCluster>& coded,
                                               const Executor& executor) {
    ByteWriter out;
    std::vector<std::int64_t> values;
    for (const CodedCluster& cluster : coded) {
        values.push_back(static_cast<std::int64_t>(cluster.coefficients.size()));
        if (cluster.component_count == 0) continue;
        out.put(cluster.coefficient_quantizer.low);
        out.put(cluster.coefficient_quantizer.step);
    }
    append_streams(out, deal_streams(values), executor, [&](const std::vector<std::int32_t>& clusters) {
        RangeEncoder encoder;
        SeriesContexts contexts;
        for_each_component(coded, clusters, [&](std::size_t i, std::size_t l) {
            encode_series(encoder, contexts, part_of(coded[i].coefficients, coded[i].component_count, l));
        });
        return encoder.finish();
    });
    return out.take();
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

Expected<EncodedClip> encode_rlpca(PositionsView positions, const MeshTopology& mesh,
                                   const Segmentation& segmentation, const CodecParameters& parameters,
                                   const Executor& executor) {
    const auto made = make_header(positions, parameters, segmentation.cluster_count());
    if (!made) return tl::unexpected(made.error());
    const RlpcaHeader& header = *made;
    const bool local = header.space == CoordinateSpace::kLocal;
    const std::span<const Triangle> seed_triangles =
        local ? std::span<const Triangle>(segmentation.seed_triangles) : std::span<const Triangle>();
    const MeshAdjacency& adjacency = mesh.adjacency();
    const RlpcaLayout layout(segmentation.labels, seed_triangles, header.cluster_count, adjacency, executor);

    // Transform and quantise, a task a cluster.
    std::vector<SeedTrianglePath> paths(seed_triangles.size());
    std::vector<CodedCluster> coded(layout.clusters.size());
    std::vector<std::optional<Error>> errors(layout.clusters.size());
    executor.for_each(header.cluster_count, [&](std::int64_t index) {
        const auto i = static_cast<std::size_t>(index);
        if (local) paths[i] = SeedTrianglePath::of(positions, seed_triangles[i], header.lattice);
        const LocalFrameTrack track =
            local ? paths[i].track(header.lattice) : header.world_track(positions.frame_count());
        auto result = code_cluster(local_coordinates(positions, layout.clusters[i], track), header);
        if (result) {
            coded[i] = std::move(*result);
        } else {
            errors[i] = result.error();
        }
    });
    for (std::size_t i = 0; i < errors.size(); ++i) {
        if (errors[i]) return fail_within("cluster " + std::to_string(i), *errors[i]);
    }

    std::vector<SectionPayload> sections;
    sections.emplace_back(SectionId::kParameters, header.write());
    sections.emplace_back(SectionId::kSegmentation, write_segmentation(segmentation.labels, seed_triangles,
                                                                       header.cluster_count, adjacency));
    sections.emplace_back(SectionId::kFrames, local ? write_paths(paths, positions.frame_count(), executor)
                                                    : std::vector<std::uint8_t>());
    sections.emplace_back(SectionId::kBasis, basis_section(coded, layout, executor));
    sections.emplace_back(SectionId::kCoefficients, coefficients_section(coded, executor));
    EncodedClip clip;
    clip.bitstream = write_clip_bitstream(CodecMethod::kRlpca, positions.vertex_count(),
                                          positions.frame_count(), sections);
    return clip;
}

}  // namespace batchenc
