#include "pipeline/decode_result.h"

#include "io/source_clip.h"
#include "pipeline/frame_range.h"
#include "pipeline/guarded.h"
#include "pipeline/result_decoder.h"
#include "pipeline/stopwatch.h"

namespace batchenc {

namespace {

Expected<DecodeReport> decode(const DecodeRequest& request, const Executor& executor,
                              const std::atomic<bool>& stop, const std::function<void(double)>& progress) {
    const Stopwatch watch;
    std::error_code ignored;  // a path that cannot be looked up is no other's twin
    if (std::filesystem::equivalent(request.result, request.output, ignored))
        return fail(ErrorCode::kInvalidArgument, "the output is the result itself", request.output.string());
    // Before the work, which a file in the way would waste; the writer looks again.
    if (!request.overwrite && std::filesystem::exists(request.output, ignored))
        return fail(ErrorCode::kExists, "exists; --overwrite replaces it", request.output.string());

    auto decoder = ResultDecoder::open(request.result, request.memory_bytes);
    if (!decoder) return tl::unexpected(decoder.error());
    const ResultHeader& header = decoder->reader().header();
    const auto span =
        frames_of("result", request.result, header.frame_count, request.frame_begin, request.frame_end);
    if (!span) return tl::unexpected(span.error());
    const std::int64_t begin = span->first_frame, end = begin + span->frame_count;

    // Made with the first block: a result that does not decode is not given room on the disk.
    std::unique_ptr<ClipWriter> writer;
    const auto write = [&](std::int64_t first, PositionsView frames) -> Expected<void> {
        if (stop.load(std::memory_order_relaxed)) throw Interrupted{};
        if (!writer) {
            auto created =
                ClipWriter::create(request.output, end - begin, header.vertex_count, decoder->triangles(),
                                   header.fps, header.name, request.overwrite);
            if (!created) return tl::unexpected(created.error());
            writer = std::move(*created);
        }
        const auto written = writer->write_frames(first - begin, frames);
        progress(static_cast<double>(first + frames.frame_count() - begin) /
                 static_cast<double>(end - begin));
        return written;
    };
    if (auto done = decoder->decode_frames(begin, end, request.components, executor, write); !done)
        return tl::unexpected(done.error());
    if (auto done = writer->finish(); !done) return tl::unexpected(done.error());
    return DecodeReport{end - begin, header.vertex_count, header.triangle_count, watch.seconds()};
}

}  // namespace

Expected<DecodeReport> decode_result(const DecodeRequest& request, const Executor& executor,
                                     const std::atomic<bool>& stop,
                                     const std::function<void(double)>& progress) {
    return guarded(stop, [&] { return decode(request, executor, stop, progress); });
}

}  // namespace batchenc
