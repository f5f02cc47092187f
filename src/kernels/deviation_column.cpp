#include "kernels/deviation_column.h"

#include <algorithm>
#include <utility>

namespace batchenc {
namespace {

constexpr std::int64_t kRun = 12;  // frames between two looks at the limits

bool any_below(const float* values, const float* limits) {
    int below = 0;
    for (std::int64_t v = 0; v < kVertexBlock; ++v) below |= static_cast<int>(values[v] < limits[v]);
    return below != 0;
}

}  // namespace

DeviationColumn::DeviationColumn(const VertexBlocks& blocks, LocalFrameTrack track)
    : blocks_(&blocks),
      track_(std::move(track)),
      values_(blocks.count() * kVertexBlock),
      frames_(static_cast<std::size_t>(blocks.count()), 1) {
    std::fill_n(values_.data(), blocks.count() * kVertexBlock, 0.0f);
}

void DeviationColumn::extend(std::int64_t block, const float* limits) {
    float* values = values_.data() + block * kVertexBlock;
    std::int64_t& frames = frames_[static_cast<std::size_t>(block)];
    while (frames < blocks_->frame_count() && any_below(values, limits)) {
        const std::int64_t end = std::min(frames + kRun, blocks_->frame_count());
        add_deviation(blocks_->block(block), frames, end, track_, values);
        frames = end;
    }
}

}  // namespace batchenc
