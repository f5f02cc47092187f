#include "pipeline/result_decoder.h"

#include <algorithm>

#include "codecs/clip_codec.h"
#include "codecs/connectivity_bitstream.h"

namespace batchenc {

namespace {

/// Frames that are decoded together, at most: enough of them to keep every thread busy to the block's end,
/// few enough that two blocks are little memory.
constexpr std::int64_t kBlockBytes = 64 << 20;

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
    std::vector<Triangle> coded_triangles;
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
        coded_triangles = std::move(*triangles);
    }
    if (static_cast<std::int64_t>(coded_triangles.size()) != header.triangle_count)
        return fail(ErrorCode::kCorrupt,
                    "holds " + std::to_string(coded_triangles.size()) + " triangles where the header says " +
                        std::to_string(header.triangle_count),
                    where);
    decoder.mesh_ = std::make_shared<const MeshTopology>(std::move(coded_triangles), header.vertex_count);
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
    return visit_waiting(visit);
}

Expected<void> ResultDecoder::visit_waiting(const Visit& visit) {
    if (waiting_.frame_count == 0) return {};
    const PositionsView frames(waiting_.positions.data(), waiting_.frame_count,
                               reader_->header().vertex_count);
    waiting_.frame_count = 0;
    return visit(waiting_.first_frame, frames);
}

Expected<std::unique_ptr<DecodedClip>> ResultDecoder::open_clip(std::int64_t index, std::int32_t components,
                                                                const Executor& executor) const {
    const std::string where = path_ + ": clip " + std::to_string(index);
    const auto bitstream = reader_->read_clip(index);
    if (!bitstream) return tl::unexpected(bitstream.error());
    const auto info = read_clip_info(*bitstream);
    if (!info) return fail_within(where, info.error());
    const ClipSpan span = reader_->clips()[static_cast<std::size_t>(index)];
    if (info->vertex_count != reader_->header().vertex_count || info->frame_count != span.frame_count)
        return fail(ErrorCode::kCorrupt, "the bitstream is of another shape than the file says", where);
    const std::int64_t frame_bytes = 12 * info->vertex_count;
    if (frame_bytes > memory_bytes_)
        return fail(ErrorCode::kLimit,
                    "one frame needs " + std::to_string(frame_bytes) + " bytes, more than --memory allows",
                    where);
    auto clip = decode_clip(*bitstream, mesh_, components, memory_bytes_, executor);
    if (!clip) return fail_within(where, clip.error());
    return clip;
}

Expected<void> ResultDecoder::decode_clip_frames(std::int64_t index, std::int64_t begin, std::int64_t end,
                                                 std::int32_t components, const Executor& executor,
                                                 const Visit& visit) {
    const std::int64_t vertex_count = reader_->header().vertex_count;
    const std::int64_t clip_begin = reader_->clips()[static_cast<std::size_t>(index)].first_frame;
    const std::string where = path_ + ": clip " + std::to_string(index);
    // Blocks of even size: a short last one would leave threads without work.
    const std::int64_t most_frames =
        std::max<std::int64_t>(1, std::min(kBlockBytes, memory_bytes_ / 2) / (12 * vertex_count));
    const std::int64_t blocks = (end - begin + most_frames - 1) / most_frames;
    const std::int64_t block_frames = (end - begin + blocks - 1) / blocks;

    std::unique_ptr<DecodedClip> clip;
    const auto decode_block = [&](std::int64_t first) -> Expected<void> {
        if (!clip) {
            auto opened = open_clip(index, components, executor);
            if (!opened) return tl::unexpected(opened.error());
            clip = std::move(*opened);
        }
        decoding_.first_frame = first;
        decoding_.frame_count = std::min(block_frames, end - first);
        decoding_.positions.resize(static_cast<std::size_t>(3 * decoding_.frame_count * vertex_count));
        const MutablePositionsView frames(decoding_.positions.data(), decoding_.frame_count, vertex_count);
        if (auto done = clip->reconstruct(first - clip_begin, frames, executor); !done)
            return fail_within(where, done.error());
        return {};
    };
    for (std::int64_t first = begin; first < end; first += block_frames) {
        // The one before is visited beside, which is mostly a file's writing or reading. Decoding comes
        // first: its loop is open to the thread that is done with the visit, the other way round it is not.
        Expected<void> decoded, visited;
        executor.for_each(2, [&](std::int64_t task) {
            if (task == 0)
                decoded = decode_block(first);
            else
                visited = visit_waiting(visit);
        });
        if (!visited) return visited;
        if (!decoded) {
            waiting_.frame_count = 0;
            return decoded;
        }
        std::swap(decoding_, waiting_);
    }
    return {};
}

}  // namespace batchenc
