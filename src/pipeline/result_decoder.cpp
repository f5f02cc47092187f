#include "pipeline/result_decoder.h"

#include <algorithm>

#include "codecs/clip_codec.h"
#include "codecs/connectivity_bitstream.h"

namespace batchenc {

namespace {

/// Frames that are decoded together: enough to keep every thread busy, few enough to stay near the caches.
constexpr std::int64_t kBlockBytes = 16 << 20;

}  // namespace

Expected<ResultDecoder> ResultDecoder::open(const std::filesystem::path& path, std::int64_t memory_bytes) {
    auto reader = ResultReader::open(path);
    if (!reader) return tl::unexpected(reader.error());
    ResultDecoder decoder;
    decoder.path_ = path.string();
    decoder.memory_bytes_ = memory_bytes;
    decoder.reader_ = std::move(*reader);

    const ResultHeader& header = decoder.reader_->header();
    const std::string where = decoder.path_ + ":/connectivity/bitstream";
    auto bitstream = decoder.reader_->read_connectivity();
    if (!bitstream) return tl::unexpected(bitstream.error());
    if (!bitstream->empty()) {
        constexpr std::int64_t kBytesPerTriangle =
            288;  // the triangle, its neighbours, and what decoding keeps (measured: 99 to 279)
        if (header.triangle_count > memory_bytes / kBytesPerTriangle) {
            return fail(
                ErrorCode::kLimit,
                std::to_string(header.triangle_count) + " triangles need more memory than --memory allows",
                where);
        }
        auto triangles = read_connectivity_bitstream(*bitstream, header.vertex_count, header.triangle_count);
        if (!triangles) return fail_within(where, triangles.error());
        decoder.triangles_ = std::move(*triangles);
    }
    if (static_cast<std::int64_t>(decoder.triangles_.size()) != header.triangle_count)
        return fail(ErrorCode::kCorrupt,
                    "holds " + std::to_string(decoder.triangles_.size()) +
                        " triangles where the header says " + std::to_string(header.triangle_count),
                    where);
    return decoder;
}

Expected<void> ResultDecoder::decode_frames(std::int64_t begin, std::int64_t end, std::int32_t components,
                                            const Executor& executor, const Visit& visit) {
    const std::vector<ClipSpan>& clips = reader_->clips();
    for (std::size_t i = 0; i < clips.size(); ++i) {
        const std::int64_t first = std::max(begin, clips[i].first_frame);
        const std::int64_t last = std::min(end, clips[i].first_frame + clips[i].frame_count);
        if (first >= last) continue;
        const auto index = static_cast<std::int64_t>(i);
        if (auto done = decode_clip_frames(index, first, last, components, executor, visit); !done)
            return done;
    }
    return {};
}

Expected<void> ResultDecoder::decode_clip_frames(std::int64_t index, std::int64_t begin, std::int64_t end,
                                                 std::int32_t components, const Executor& executor,
                                                 const Visit& visit) {
    const ClipSpan span = reader_->clips()[static_cast<std::size_t>(index)];
    const std::int64_t vertex_count = reader_->header().vertex_count;
    const std::string where = path_ + ": clip " + std::to_string(index);

    const auto bitstream = reader_->read_clip(index);
    if (!bitstream) return tl::unexpected(bitstream.error());
    const auto info = read_clip_info(*bitstream);
    if (!info) return fail_within(where, info.error());
    if (info->vertex_count != vertex_count || info->frame_count != span.frame_count)
        return fail(ErrorCode::kCorrupt, "the bitstream is of another shape than the file says", where);
    const std::int64_t frame_bytes = 12 * vertex_count;
    if (frame_bytes > memory_bytes_)
        return fail(ErrorCode::kLimit,
                    "one frame needs " + std::to_string(frame_bytes) + " bytes, more than --memory allows",
                    where);
    const auto clip = decode_clip(*bitstream, triangles_, components, memory_bytes_, executor);
    if (!clip) return fail_within(where, clip.error());

    const std::int64_t block_frames =
        std::max<std::int64_t>(1, std::min(kBlockBytes, memory_bytes_) / frame_bytes);
    for (std::int64_t first = begin; first < end; first += block_frames) {
        const std::int64_t count = std::min(block_frames, end - first);
        block_.resize(static_cast<std::size_t>(3 * count * vertex_count));
        const MutablePositionsView block(block_.data(), count, vertex_count);
        if (auto done = (*clip)->reconstruct(first - span.first_frame, block, executor); !done)
            return fail_within(where, done.error());
        if (auto done = visit(first, block); !done) return done;
    }
    return {};
}

}  // namespace batchenc
