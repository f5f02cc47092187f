#include "codecs/rlpca.h"
#include "codecs/rlpca_clusters.h"

namespace batchenc {

Expected<EncodedClip> encode_rlpca(PositionsView positions, const MeshTopology& mesh,
                                   const Segmentation& segmentation, const CodecParameters& parameters,
                                   const Executor& executor) {
    const auto source = RlpcaSource::of(positions, mesh, segmentation, parameters, executor);
    if (!source) return tl::unexpected(source.error());
    const RlpcaHeader& header = source->header();
    std::vector<CodedCluster> coded(static_cast<std::size_t>(header.cluster_count));
    const auto done = for_each_cluster(header.cluster_count, executor, [&](std::size_t i) -> Expected<void> {
        const ColMajorMatrixXf matrix = source->local_coordinates(i);
        auto components = principal_components(matrix, header.components);
        if (!components) return tl::unexpected(components.error());
        auto cluster = quantize_cluster(matrix, std::move(*components), header);
        if (!cluster) return tl::unexpected(cluster.error());
        coded[i] = std::move(*cluster);
        return {};
    });
    if (!done) return tl::unexpected(done.error());
    EncodedClip clip;
    clip.bitstream = source->write(CodecMethod::kRlpca, header.components, coded, executor);
    return clip;
}

}  // namespace batchenc
