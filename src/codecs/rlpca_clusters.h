#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "codecs/clip_bitstream.h"
#include "codecs/integer_contexts.h"
#include "codecs/rlpca_layout.h"
#include "codecs/segmentation.h"
#include "core/error.h"
#include "core/executor.h"
#include "core/matrix.h"
#include "core/mesh_sequence.h"
#include "core/parameters.h"
#include "kernels/mesh_topology.h"
#include "kernels/quantizer.h"

namespace batchenc {

// What the encoders of RLPCA and ORLPCA share: clusters as matrices, as quantised components, as a bitstream.

/// One cluster as integers, ready to be coded.
struct CodedCluster {
    std::int64_t component_count = 0;  ///< L of this cluster
    MinMaxQuantizer basis_quantizer, coefficient_quantizer;
    std::vector<std::int32_t> basis;         ///< L columns of 3n levels, relative to the level of zero
    std::vector<std::int32_t> coefficients;  ///< L rows of F levels, likewise
};

/// The leading left singular vectors of a cluster's matrix, at most `count`; none of an empty matrix.
/// matrix: 3n × F. Errors: kNotFinite, kNumerical.
Expected<ColMajorMatrixXf> principal_components(const ColMajorMatrixXf& matrix, std::int64_t count);

/// Quantises components and the coefficients that fit the matrix best with them. Components at the end whose
/// coefficients would all be zero are left out.
/// matrix: 3n × F. components: 3n × L, by principal_components. Error: kLimit, beyond what float32 carries.
Expected<CodedCluster> quantize_cluster(const ColMajorMatrixXf& matrix, ColMajorMatrixXf components,
                                        const RlpcaHeader& header);

/// The sections of basis and coefficients of these clusters; ComponentClusters reads them.
std::vector<std::uint8_t> basis_section(const std::vector<CodedCluster>& coded, const RlpcaLayout& layout,
                                        const Executor& executor);
std::vector<std::uint8_t> coefficients_section(const std::vector<CodedCluster>& coded, const SeriesForm& form,
                                               const Executor& executor);

/// Bits that the entropy coder makes of each component, its basis column and its coefficients, in the streams
/// of all these clusters together: [cluster][component].
std::vector<std::vector<double>> component_bits(const std::vector<CodedCluster>& coded,
                                                const RlpcaLayout& layout, const Executor& executor);

/// Calls work(cluster) for each cluster; of several errors the first cluster's is given, with its place.
template <typename Work>
Expected<void> for_each_cluster(std::int32_t cluster_count, const Executor& executor, Work work) {
    std::vector<std::optional<Error>> errors(static_cast<std::size_t>(cluster_count));
    executor.for_each(cluster_count, [&](std::int64_t index) {
        const auto i = static_cast<std::size_t>(index);
        if (Expected<void> done = work(i); !done) errors[i] = done.error();
    });
    for (std::size_t i = 0; i < errors.size(); ++i) {
        if (errors[i]) return fail_within("cluster " + std::to_string(i), *errors[i]);
    }
    return {};
}

/// A clip as these coders see it, and what its bitstream holds whatever becomes of the components.
class RlpcaSource {
 public:
    /// Arguments as of encode_clip; positions outlive the object. Error: kLimit.
    static Expected<RlpcaSource> of(PositionsView positions, const MeshTopology& mesh,
                                    const Segmentation& segmentation, const CodecParameters& parameters,
                                    const Executor& executor);

    const RlpcaHeader& header() const { return header_; }
    const RlpcaLayout& layout() const { return layout_; }

    /// A_i: coordinates of a cluster's vertices in its local coordinate frames, 3n × F.
    ColMajorMatrixXf local_coordinates(std::size_t cluster) const;

    /// The clip's bitstream. most_components: what the header says of the clusters, at least what any has.
    std::vector<std::uint8_t> write(CodecMethod method, std::int32_t most_components,
                                    const std::vector<CodedCluster>& coded, const Executor& executor) const;

 private:
    RlpcaSource(PositionsView positions, RlpcaHeader header, RlpcaLayout layout)
        : positions_(positions), header_(header), layout_(std::move(layout)) {}

    PositionsView positions_;
    RlpcaHeader header_;
    RlpcaLayout layout_;
    std::vector<SeedTrianglePath> paths_;  // local space only
    std::vector<std::uint8_t> segmentation_section_, frames_section_;
};

}  // namespace batchenc
