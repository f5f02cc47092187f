#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "core/executor.h"
#include "core/mesh_sequence.h"

namespace batchenc {

/// Vertices that the kernels of segmentation treat together.
inline constexpr std::int64_t kVertexBlock = 32;

/// Floats of one block: F × 3 × kVertexBlock, as [frame][xyz][vertex].
inline std::int64_t vertex_block_size(std::int64_t frame_count) { return frame_count * 3 * kVertexBlock; }

/// Blocks that V vertices make; the last may be a part.
inline std::int64_t vertex_block_count(std::int64_t vertex_count) {
    return (vertex_count + kVertexBlock - 1) / kVertexBlock;
}

/// Floats on the boundary of a cache line and of the widest vector, not initialised.
class AlignedFloats {
 public:
    AlignedFloats() = default;
    explicit AlignedFloats(std::int64_t count)
        : lines_(std::make_unique_for_overwrite<Line[]>(static_cast<std::size_t>((count + 15) / 16))) {}
    float* data() { return lines_[0].values; }
    const float* data() const { return lines_[0].values; }

 private:
    struct alignas(64) Line {
        float values[16];
    };
    std::unique_ptr<Line[]> lines_;
};

/// Copies a block's vertices in all frames into structure of arrays, SIMD with run-time dispatch.
///
/// positions: F × V. vertices: 1 … kVertexBlock indices; the last one is repeated to fill the block. block:
/// vertex_block_size(F) floats on a 64-byte boundary, overwritten.
void gather_vertex_block(PositionsView positions, std::span<const std::int32_t> vertices, float* block);

/// The same for the vertices first_vertex, first_vertex + 1, …, to kVertexBlock of them or V.
void load_vertex_block(PositionsView positions, std::int64_t first_vertex, float* block);

/// All blocks of a clip: its positions once more, for kernels that walk over them again and again.
class VertexBlocks {
 public:
    VertexBlocks(PositionsView positions, const Executor& executor);

    std::int64_t frame_count() const { return frame_count_; }
    std::int64_t vertex_count() const { return vertex_count_; }
    std::int64_t count() const { return vertex_block_count(vertex_count_); }
    const float* block(std::int64_t index) const {
        return values_.data() + index * vertex_block_size(frame_count_);
    }

 private:
    std::int64_t frame_count_;
    std::int64_t vertex_count_;
    AlignedFloats values_;
};

}  // namespace batchenc
