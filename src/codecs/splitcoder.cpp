#include "codecs/splitcoder.h"

#include <algorithm>
#include <cmath>

#include "codecs/first_frame.h"
#include "codecs/kept_frames.h"
#include "codecs/split_fitted.h"
#include "codecs/split_gates.h"
#include "codecs/split_layout.h"
#include "codecs/static_coder.h"
#include "kernels/bounding_box.h"
#include "kernels/byte_stream.h"
#include "kernels/range_coder.h"

namespace batchenc {
namespace {

tl::unexpected<Error> corrupt(const char* message) { return fail(ErrorCode::kCorrupt, message); }

/// Clips up to this long are tried with several predictors: `fitted` has little to learn from.
constexpr std::int64_t kFewFrames = 12;

std::vector<std::uint8_t> encode_frames(PositionsView positions, const MeshTopology& mesh,
                                        const SplitHeader& header, MutablePositionsView decoded,
                                        const Executor& executor) {
    if (positions.frame_count() < 2) return {};
    return header.predictor == GeometryPredictor::kFitted
               ? encode_fitted(positions, mesh, header, decoded, executor)
               : encode_gates(positions, mesh, header, decoded);
}

}  // namespace

std::vector<std::uint8_t> SplitHeader::write() const {
    ByteWriter out;
    out.put(static_cast<std::uint8_t>(predictor));
    out.put(static_cast<std::uint8_t>(normal));
    for (const float value : center) out.put(value);
    out.put(bound);
    return out.take();
}

Expected<SplitHeader> SplitHeader::read(std::span<const std::uint8_t> payload) {
    ByteReader reader(payload);
    SplitHeader header;
    const auto predictor = reader.get<std::uint8_t>();
    const auto normal = reader.get<std::uint8_t>();
    const auto center = reader.get_array<float, 3>();
    const auto bound = reader.get<double>();
    if (!bound) return tl::unexpected(bound.error());
    header.predictor = static_cast<GeometryPredictor>(*predictor);  // there, since what follows it is
    header.normal = static_cast<NormalPredictor>(*normal);
    header.center = *center;
    header.bound = *bound;
    bool good = std::isfinite(header.bound) && header.bound >= 0.0 &&
                header.predictor != GeometryPredictor::kAuto && to_name(header.predictor) != "unknown" &&
                has_predictor(CodecMethod::kSplitcoder, header.predictor) &&
                to_name(header.normal) != "unknown";
    for (const float value : header.center) good = good && std::isfinite(value);
    if (!good) return corrupt("a parameter is outside its range");
    if (reader.remaining() != 0) return corrupt("bytes left over");
    return header;
}

Expected<EncodedClip> encode_splitcoder(PositionsView positions, const MeshTopology& mesh,
                                        const CodecParameters& parameters, const Executor& executor) {
    const BoundingBox box = bounding_box(positions);
    SplitHeader header;
    header.normal = parameters.normal;
    header.center = box.center();
    header.bound = bound_of(parameters, box);
    if (!std::isfinite(box.largest_side()))
        return fail(ErrorCode::kLimit, "the bounding box is larger than float32 can say");

    auto first = encode_first_frame(positions, mesh, header.bound, executor);
    if (!first) return tl::unexpected(first.error());
    const auto values =
        std::make_unique_for_overwrite<float[]>(static_cast<std::size_t>(positions.value_count()));
    const MutablePositionsView decoded(values.get(), positions.frame_count(), positions.vertex_count());
    std::copy(first->positions.begin(), first->positions.end(), values.get());

    std::vector<GeometryPredictor> tried = {parameters.predictor};
    if (parameters.predictor == GeometryPredictor::kAuto) {
        tried = {GeometryPredictor::kFitted};
        if (positions.frame_count() <= kFewFrames)
            tried.insert(tried.end(),
                         {GeometryPredictor::kLocalMultiway, GeometryPredictor::kLorenzoMultiway});
    }
    std::vector<std::uint8_t> frames;
    for (const GeometryPredictor predictor : tried) {
        SplitHeader trial = header;
        trial.predictor = predictor;
        std::vector<std::uint8_t> bytes = encode_frames(positions, mesh, trial, decoded, executor);
        if (predictor != tried.front() && bytes.size() >= frames.size()) continue;
        frames = std::move(bytes);
        header = trial;
    }
    ByteWriter residuals;
    residuals.put_varint(first->bitstream.size());
    residuals.put_bytes(first->bitstream);
    residuals.put_bytes(frames);
    std::vector<SectionPayload> sections;
    sections.emplace_back(SectionId::kParameters, header.write());
    sections.emplace_back(SectionId::kResiduals, residuals.take());
    EncodedClip clip;
    clip.bitstream = write_clip_bitstream(CodecMethod::kSplitcoder, positions.vertex_count(),
                                          positions.frame_count(), sections);
    return clip;
}

Expected<ClipInfo> read_splitcoder_info(const ClipBitstream& clip) {
    const auto header = SplitHeader::read(clip.payload(SectionId::kParameters));
    if (!header) return tl::unexpected(header.error());
    ClipInfo info = basic_info(clip);
    info.parameters.predictor = header->predictor;
    info.parameters.normal = header->normal;
    info.parameters.max_error = header->bound;
    return info;
}

Expected<std::unique_ptr<DecodedClip>> decode_splitcoder(const ClipBitstream& clip, const SharedMesh& mesh,
                                                         std::int64_t size_limit_bytes,
                                                         const Executor& executor) {
    const auto info = read_splitcoder_info(clip);
    if (!info) return tl::unexpected(info.error());
    const SplitHeader header = *SplitHeader::read(clip.payload(SectionId::kParameters));
    // About what a vertex takes while it is predicted, and one in a frame; checked before any is allocated.
    constexpr std::int64_t kBytesPerVertex = 1024, kBytesPerSample = 12;
    if (clip.vertex_count > size_limit_bytes / kBytesPerVertex ||
        clip.frame_count >
            (size_limit_bytes - clip.vertex_count * kBytesPerVertex) / kBytesPerSample / clip.vertex_count) {
        return fail(ErrorCode::kLimit,
                    "the clip needs more memory than allowed: " + std::to_string(clip.vertex_count) +
                        " vertices, " + std::to_string(clip.frame_count) + " frames");
    }
    ByteReader reader(clip.payload(SectionId::kResiduals));
    const auto size = reader.get_varint(reader.remaining());
    if (!size) return tl::unexpected(size.error());
    const auto first = reader.get_bytes(*size);
    if (!first) return tl::unexpected(first.error());
    const auto rest = reader.get_bytes(reader.remaining());
    // Every vertex of every frame has symbols: what cannot be in the bytes is not allocated.
    const auto samples = static_cast<std::uint64_t>(clip.vertex_count * (clip.frame_count - 1));
    if (samples > max_symbol_count(rest->size())) return corrupt("more vertices than the bytes can hold");
    auto decoded = std::make_unique<KeptFrames>(*info);
    const MutablePositionsView frames = decoded->frames();
    auto done =
        decode_first_frame(*first, *mesh, size_limit_bytes, {frames.data(), 1, clip.vertex_count}, executor);
    if (!done) return tl::unexpected(done.error());
    if (clip.frame_count == 1) {
        if (!rest->empty()) return corrupt("bytes left over");
        return decoded;
    }
    done = header.predictor == GeometryPredictor::kFitted
               ? decode_fitted(*rest, *mesh, header, frames, executor)
               : decode_gates(*rest, *mesh, header, frames);
    if (!done) return fail_within(section_name(SectionId::kResiduals), done.error());
    return decoded;
}

}  // namespace batchenc
