#include "codecs/first_frame.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "codecs/static_coder.h"

namespace batchenc {

Expected<CodedFirstFrame> encode_first_frame(PositionsView positions, const MeshTopology& mesh, double bound,
                                             const Executor& executor) {
    CodecParameters parameters;
    parameters.method = CodecMethod::kStatic;
    parameters.predictor = GeometryPredictor::kWeighted;
    parameters.max_error = bound;
    auto coded = encode_static(positions.frames(0, 1), mesh, parameters, executor);
    if (!coded) return fail_within("the first frame", coded.error());
    CodedFirstFrame first;
    first.bitstream = std::move(coded->bitstream);
    first.positions.resize(static_cast<std::size_t>(3 * positions.vertex_count()));
    const auto done = decode_first_frame(first.bitstream, mesh, std::numeric_limits<std::int64_t>::max(),
                                         {first.positions.data(), 1, positions.vertex_count()}, executor);
    if (!done) return tl::unexpected(done.error());
    return first;
}

Expected<void> decode_first_frame(std::span<const std::uint8_t> bitstream, const MeshTopology& mesh,
                                  std::int64_t size_limit_bytes, MutablePositionsView frame,
                                  const Executor& executor) {
    if (auto done = decode_static_frame(bitstream, mesh, size_limit_bytes, frame, executor); !done)
        return fail_within("the first frame", done.error());
    const float* values = frame.data();
    if (!std::all_of(values, values + 3 * frame.vertex_count(), [](float x) { return std::isfinite(x); }))
        return fail(ErrorCode::kCorrupt, "the first frame is not finite");
    return {};
}

}  // namespace batchenc
