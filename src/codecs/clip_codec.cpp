#include "codecs/clip_codec.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "codecs/baselines/baselines.h"
#include "codecs/clip_bitstream.h"
#include "codecs/orlpca.h"
#include "codecs/pdct.h"
#include "codecs/rlpca.h"
#include "codecs/rtpca.h"
#include "codecs/splitcoder.h"
#include "codecs/static_coder.h"

namespace batchenc {
namespace {

tl::unexpected<Error> unknown_method(CodecMethod method) {
    return fail(ErrorCode::kUnsupported,
                "coder '" + std::string(to_name(method)) + "' is not in this version");
}

/// RTPCA or, where every vertex has a bound and it is smaller or the only one, SplitCoder.
Expected<EncodedClip> encode_smallest(PositionsView positions, const MeshTopology& mesh,
                                      const Segmentation& segmentation, CodecParameters parameters,
                                      const Executor& executor) {
    auto components = encode_rtpca(positions, mesh, segmentation, parameters, executor);
    if (!(parameters.max_error > 0.0 || parameters.max_error_relative > 0.0)) return components;
    parameters.method = CodecMethod::kSplitcoder;
    auto vertices = encode_splitcoder(positions, mesh, parameters, executor);
    if (!vertices) return components;
    return components && components->bitstream.size() <= vertices->bitstream.size() ? components : vertices;
}

/// Fails with kUnsupported for any other method: check_parameters and these switches know the same ones.
Expected<EncodedClip> encode_with(PositionsView positions, const MeshTopology& mesh,
                                  const Segmentation& segmentation, const CodecParameters& parameters,
                                  const Executor& executor) {
    switch (parameters.method) {
        case CodecMethod::kAuto:
            return encode_smallest(positions, mesh, segmentation, parameters, executor);
        case CodecMethod::kStatic:
            return encode_static(positions, mesh, parameters, executor);
        case CodecMethod::kSplitcoder:
            return encode_splitcoder(positions, mesh, parameters, executor);
        case CodecMethod::kRlpca:
            return encode_rlpca(positions, mesh, segmentation, parameters, executor);
        case CodecMethod::kOrlpca:
            return encode_orlpca(positions, mesh, segmentation, parameters, executor);
        case CodecMethod::kPdct:
            return encode_pdct(positions, mesh, segmentation, parameters, executor);
        case CodecMethod::kRtpca:
            return encode_rtpca(positions, mesh, segmentation, parameters, executor);
        default:
            if (!is_baseline(parameters.method)) return unknown_method(parameters.method);
            return encode_baseline(positions, mesh, segmentation, parameters, executor);
    }
}

Expected<ClipInfo> read_info(const ClipBitstream& clip) {
    switch (clip.method) {
        case CodecMethod::kStatic:
            return read_static_info(clip);
        case CodecMethod::kSplitcoder:
            return read_splitcoder_info(clip);
        case CodecMethod::kRlpca:
        case CodecMethod::kOrlpca:
            return read_rlpca_info(clip);
        case CodecMethod::kPdct:
            return read_pdct_info(clip);
        case CodecMethod::kRtpca:
            return read_rtpca_info(clip);
        default:
            if (!is_baseline(clip.method)) return unknown_method(clip.method);
            return read_baseline_info(clip);
    }
}

/// Bytes of a clip by section; headers are what the payloads leave.
SectionBytes section_bytes_of(const ClipBitstream& clip, std::size_t size_bytes) {
    const auto size_of = [&](SectionId id) { return static_cast<std::int64_t>(clip.payload(id).size()); };
    SectionBytes bytes;
    bytes.segmentation = size_of(SectionId::kSegmentation);
    bytes.frames = size_of(SectionId::kFrames);
    bytes.basis = size_of(SectionId::kBasis);
    bytes.coefficients = size_of(SectionId::kCoefficients);
    bytes.residuals = size_of(SectionId::kResiduals);
    bytes.headers = static_cast<std::int64_t>(size_bytes) - bytes.total();
    return bytes;
}

Expected<void> check_finite(PositionsView positions) {
    const std::int64_t values_per_frame = 3 * positions.vertex_count();
    for (std::int64_t f = 0; f < positions.frame_count(); ++f) {
        const float* p = positions.at(f, 0);
        std::uint32_t largest =
            0;  // on bits, so that the loop vectorises: exponents of all ones are NaN and Inf
        for (std::int64_t k = 0; k < values_per_frame; ++k)
            largest = std::max(largest, std::bit_cast<std::uint32_t>(p[k]) & 0x7fffffffu);
        if (largest < 0x7f800000u) continue;
        std::int64_t k = 0;
        while (std::isfinite(p[k])) ++k;
        return fail(ErrorCode::kNotFinite,
                    "frame " + std::to_string(f) + ", vertex " + std::to_string(k / 3) + " is not finite");
    }
    return {};
}

}  // namespace

SectionBytes& SectionBytes::operator+=(const SectionBytes& other) {
    headers += other.headers;
    segmentation += other.segmentation;
    frames += other.frames;
    basis += other.basis;
    coefficients += other.coefficients;
    residuals += other.residuals;
    return *this;
}

Expected<void> check_frames(const ClipInfo& info, std::int64_t begin, const MutablePositionsView& out) {
    if (begin >= 0 && begin <= info.frame_count && out.frame_count() >= 0 &&
        out.frame_count() <= info.frame_count - begin && out.vertex_count() == info.vertex_count)
        return {};
    return fail(ErrorCode::kOutOfRange, "frames " + std::to_string(begin) + " to " +
                                            std::to_string(begin + out.frame_count()) + " of " +
                                            std::to_string(info.frame_count) + " frames were asked for");
}

Expected<EncodedClip> encode_clip(PositionsView positions, const MeshTopology& mesh,
                                  const Segmentation& segmentation, const CodecParameters& parameters,
                                  const Executor& executor) {
    if (auto valid = check_parameters(parameters); !valid) return tl::unexpected(valid.error());
    if (positions.frame_count() < 1 || positions.vertex_count() < 1)
        return fail(ErrorCode::kInvalidArgument, "a clip needs a frame and a vertex");
    if (mesh.vertex_count() != positions.vertex_count())
        return fail(ErrorCode::kInvalidArgument, "the triangles are of another mesh");
    if (uses_clusters(parameters.method) &&
        (static_cast<std::int64_t>(segmentation.labels.size()) != positions.vertex_count() ||
         segmentation.cluster_count() < 1)) {
        return fail(ErrorCode::kInvalidArgument, "the segmentation is not of this clip");
    }
    if (auto finite = check_finite(positions); !finite) return tl::unexpected(finite.error());
    auto clip = encode_with(positions, mesh, segmentation, parameters, executor);
    if (!clip) return clip;
    auto info = read_clip_info(clip->bitstream);
    if (!info) return tl::unexpected(info.error());
    clip->section_bytes = info->section_bytes;
    return clip;
}

Expected<EncodedClip> encode_clip(PositionsView positions, std::span<const Triangle> triangles,
                                  const Segmentation& segmentation, const CodecParameters& parameters,
                                  const Executor& executor) {
    const MeshTopology mesh({triangles.begin(), triangles.end()}, positions.vertex_count());
    return encode_clip(positions, mesh, segmentation, parameters, executor);
}

ClipInfo basic_info(const ClipBitstream& clip) {
    ClipInfo info;
    info.method = clip.method;
    info.vertex_count = clip.vertex_count;
    info.frame_count = clip.frame_count;
    info.parameters.method = clip.method;
    return info;
}

Expected<ClipInfo> read_clip_info(std::span<const std::uint8_t> bitstream) {
    const auto clip = parse_clip_bitstream(bitstream);
    if (!clip) return tl::unexpected(clip.error());
    auto info = read_info(*clip);
    if (info) info->section_bytes = section_bytes_of(*clip, bitstream.size());
    return info;
}

Expected<std::unique_ptr<DecodedClip>> decode_clip(std::span<const std::uint8_t> bitstream,
                                                   const SharedMesh& mesh, std::int32_t components,
                                                   std::int64_t size_limit_bytes, const Executor& executor) {
    const auto clip = parse_clip_bitstream(bitstream);
    if (!clip) return tl::unexpected(clip.error());
    if (clip->vertex_count != mesh->vertex_count())
        return fail(ErrorCode::kCorrupt, "the clip has " + std::to_string(clip->vertex_count) +
                                             " vertices, its mesh " + std::to_string(mesh->vertex_count()));
    switch (clip->method) {
        case CodecMethod::kStatic:
            return decode_static(*clip, mesh, size_limit_bytes, executor);
        case CodecMethod::kSplitcoder:
            return decode_splitcoder(*clip, mesh, size_limit_bytes, executor);
        case CodecMethod::kRlpca:
        case CodecMethod::kOrlpca:
            return decode_rlpca(*clip, *mesh, components, size_limit_bytes, executor);
        case CodecMethod::kPdct:
            return decode_pdct(*clip, mesh, size_limit_bytes, executor);
        case CodecMethod::kRtpca:
            return decode_rtpca(*clip, mesh, components, size_limit_bytes, executor);
        default:
            if (!is_baseline(clip->method)) return unknown_method(clip->method);
            return decode_baseline(*clip, mesh, components, size_limit_bytes, executor);
    }
}

Expected<std::unique_ptr<DecodedClip>> decode_clip(std::span<const std::uint8_t> bitstream,
                                                   std::span<const Triangle> triangles,
                                                   std::int32_t components, std::int64_t size_limit_bytes,
                                                   const Executor& executor) {
    const auto clip = parse_clip_bitstream(bitstream);
    if (!clip) return tl::unexpected(clip.error());
    for (const Triangle& t : triangles) {
        for (const std::int32_t v : t) {
            if (v < 0 || v >= clip->vertex_count)
                return fail(ErrorCode::kCorrupt, "the triangles name vertices that the clip does not have");
        }
    }
    const auto mesh = std::make_shared<const MeshTopology>(
        std::vector<Triangle>(triangles.begin(), triangles.end()), clip->vertex_count);
    return decode_clip(bitstream, mesh, components, size_limit_bytes, executor);
}

}  // namespace batchenc
