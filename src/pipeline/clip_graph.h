#pragma once

#include <cstdint>
#include <functional>
#include <memory>

namespace batchenc {

struct ClipInFlight;

/// What the graph calls for each clip. Nothing of it may throw.
struct ClipStages {
    /// The next clip, its `number` counting up from 0; null when there are no more. Called by one thread at
    /// a time.
    std::function<std::shared_ptr<ClipInFlight>()> next;

    std::function<void(ClipInFlight&)> read;     ///< one clip at a time
    std::function<void(ClipInFlight&)> segment;  ///< any number of clips at once
    std::function<void(ClipInFlight&)> code;     ///< any number of clips at once
    std::function<void(ClipInFlight&)> verify;   ///< any number of clips at once
    std::function<void(ClipInFlight&)> write;    ///< one clip at a time, in the order of `next`
};

/// Sends every clip through read, segment, code, verify and write. At most `tokens` (1 or more) clips are
/// between the beginning of read and the end of write. Returns when all have been written.
void run_clip_graph(const ClipStages& stages, int tokens);

}  // namespace batchenc
