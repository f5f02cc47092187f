#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "codecs/clip_codec.h"
#include "core/executor.h"
#include "core/mesh_sequence.h"
#include "io/result_file.h"

namespace batchenc {

/// A result opened for decoding a run of frames at a time, in bounded memory.
class ResultDecoder {
 public:
    /// Opens the result and decodes its triangles. memory_bytes: bound on what is allocated afterwards for a
    /// clip and a block of frames, whatever the file claims.
    /// Errors: those of ResultReader::open, and kCorrupt where connectivity and header disagree.
    static Expected<ResultDecoder> open(const std::filesystem::path& path, std::int64_t memory_bytes);

    ResultReader& reader() const { return *reader_; }
    const std::vector<Triangle>& triangles() const { return mesh_->triangles(); }

    /// Takes decoded frames, the first of which is frame `first_frame` of the result.
    using Visit = std::function<Expected<void>(std::int64_t first_frame, PositionsView frames)>;

    /// Decodes frames [begin, end), a non-empty range of the result, in order, reading only the clips that
    /// they lie in. components: use only the first so many (negative: all). Ends at the first error, be it
    /// visit's. A block is visited while the next one is decoded, by any one thread at a time.
    Expected<void> decode_frames(std::int64_t begin, std::int64_t end, std::int32_t components,
                                 const Executor& executor, const Visit& visit);

 private:
    ResultDecoder() = default;
    /// A run of decoded frames.
    struct Block {
        std::int64_t first_frame = 0;
        std::int64_t frame_count = 0;  // none: nothing is waiting to be visited
        std::vector<float> positions;
    };

    Expected<void> decode_clip_frames(std::int64_t index, std::int64_t begin, std::int64_t end,
                                      std::int32_t components, const Executor& executor, const Visit& visit);
    Expected<std::unique_ptr<DecodedClip>> open_clip(std::int64_t index, std::int32_t components,
                                                     const Executor& executor) const;
    Expected<void> visit_waiting(const Visit& visit);

    std::string path_;
    std::int64_t memory_bytes_ = 0;
    std::unique_ptr<ResultReader> reader_;
    SharedMesh mesh_;
    Block decoding_, waiting_;
};

}  // namespace batchenc
