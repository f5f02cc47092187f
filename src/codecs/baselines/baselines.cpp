#include "codecs/baselines/baselines.h"

#include "codecs/baselines/affine_motion.h"
#include "codecs/baselines/baseline_header.h"
#include "codecs/baselines/components.h"
#include "codecs/baselines/octree_motion.h"
#include "codecs/baselines/predicted.h"
#include "codecs/baselines/trajectories.h"
#include "codecs/baselines/wavelets.h"

namespace batchenc {
namespace {

tl::unexpected<Error> unknown_baseline(CodecMethod method) {
    return fail(ErrorCode::kUnsupported,
                "coder '" + std::string(to_name(method)) + "' is not in this version");
}

}  // namespace

Expected<EncodedClip> encode_baseline(PositionsView positions, const MeshTopology& mesh,
                                      const Segmentation& segmentation, const CodecParameters& parameters,
                                      const Executor& executor) {
    auto header = BaselineHeader::of(positions, parameters);
    if (!header) return tl::unexpected(header.error());
    switch (parameters.method) {
        case CodecMethod::kBaselineStatic:
        case CodecMethod::kBaselineLpc:
        case CodecMethod::kBaselineDynapack:
        case CodecMethod::kBaselineAngle:
            return encode_predicted(positions, mesh, *header, parameters.method, executor);
        case CodecMethod::kBaselinePca:
        case CodecMethod::kBaselinePcaLpc:
        case CodecMethod::kBaselineCpca:
            return encode_component_baseline(positions, mesh, segmentation, parameters, *header, executor);
        case CodecMethod::kBaselineCoddyac:
            return encode_trajectory_baseline(positions, mesh, parameters, *header, executor);
        case CodecMethod::kBaselineAffine:
            return encode_affine_motion(positions, mesh, segmentation, *header, executor);
        case CodecMethod::kBaselineOctree:
            return encode_octree_motion(positions, mesh, *header, executor);
        case CodecMethod::kBaselineWavelet:
            return encode_wavelets(positions, mesh, *header, executor);
        default:
            return unknown_baseline(parameters.method);
    }
}

Expected<ClipInfo> read_baseline_info(const ClipBitstream& clip) {
    const auto header = BaselineHeader::read(clip.payload(SectionId::kParameters));
    if (!header) return fail_within(section_name(SectionId::kParameters), header.error());
    ClipInfo info = basic_info(clip);
    info.cluster_count = header->cluster_count;
    info.component_count = header->components;
    info.parameters.components = header->components;
    info.parameters.bits = header->bits;
    info.parameters.basis_bits = header->basis_bits;
    info.parameters.coefficient_bits = header->coefficient_bits;
    info.parameters.lpc_order = header->lpc_order;
    info.parameters.predictor = header->predictor;
    return info;
}

Expected<std::unique_ptr<DecodedClip>> decode_baseline(const ClipBitstream& clip, const SharedMesh& mesh,
                                                       std::int32_t components, std::int64_t size_limit_bytes,
                                                       const Executor& executor) {
    switch (clip.method) {
        case CodecMethod::kBaselineStatic:
        case CodecMethod::kBaselineLpc:
        case CodecMethod::kBaselineDynapack:
        case CodecMethod::kBaselineAngle:
            return decode_predicted(clip, mesh, size_limit_bytes, executor);
        case CodecMethod::kBaselinePca:
        case CodecMethod::kBaselinePcaLpc:
        case CodecMethod::kBaselineCpca:
            return decode_component_baseline(clip, mesh, components, size_limit_bytes, executor);
        case CodecMethod::kBaselineCoddyac:
            return decode_trajectory_baseline(clip, mesh, components, size_limit_bytes);
        case CodecMethod::kBaselineAffine:
            return decode_affine_motion(clip, mesh, size_limit_bytes, executor);
        case CodecMethod::kBaselineOctree:
            return decode_octree_motion(clip, mesh, size_limit_bytes, executor);
        case CodecMethod::kBaselineWavelet:
            return decode_wavelets(clip, mesh, size_limit_bytes, executor);
        default:
            return unknown_baseline(clip.method);
    }
}

}  // namespace batchenc
