#pragma once

#include <cstdint>
#include <vector>

#include "kernels/deviation.h"
#include "kernels/vertex_block.h"

namespace batchenc {

/// One column of theta (4.1): the deviations of all vertices in one cluster, each block of vertices summed
/// over as many frames as was needed so far. As every frame adds a square, what stands there never exceeds
/// theta, and a block whose sums have all reached what its vertices have elsewhere need not go on. Going on
/// later takes up where it stopped.
class DeviationColumn {
 public:
    /// blocks: of the clip; outlives the object. track: of the cluster, with as many frames.
    DeviationColumn(const VertexBlocks& blocks, LocalFrameTrack track);

    /// Goes on with one block until none of its vertices is below its limit, or all frames are in. Blocks may
    /// be extended at once from different threads. limits: kVertexBlock values, world units squared.
    void extend(std::int64_t block, const float* limits);

    bool is_complete(std::int64_t block) const {
        return frames_[static_cast<std::size_t>(block)] == blocks_->frame_count();
    }
    /// Theta, or what it is at least where the vertex' block is not complete.
    float operator[](std::size_t vertex) const { return values_.data()[vertex]; }
    /// The kVertexBlock values of one block.
    const float* block(std::int64_t index) const { return values_.data() + index * kVertexBlock; }

 private:
    const VertexBlocks* blocks_;
    LocalFrameTrack track_;
    AlignedFloats values_;
    std::vector<std::int64_t> frames_;  // that are in, a block each
};

}  // namespace batchenc
