#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "kernels/range_coder.h"

namespace batchenc {

// Rows of quantised transform coefficients ("levels") as coded integers: three values a column, rows of one
// cluster one after another, several clusters in a stream. What a level is likely to be follows from the
// magnitudes around it, in the same row and in the rows before; all of it integers, so that both sides agree.

/// Magnitudes of the rows coded before, of one cluster. One object a cluster and side.
class RowMemory {
 public:
    /// columns: n of every row. rows: rows of a block; row t of a block remembers rows t of those before.
    RowMemory(std::int64_t columns, std::int64_t rows);

    /// The expectation for level j (3 × column + coordinate) of row t: a weighted sum of magnitudes, 0 …
    /// 2^24, where what stands in row[0 … j - 1] is the present row as far as it is known. row: six zeros
    /// stand before it.
    std::int32_t expectation(std::size_t t, std::size_t j, const std::int32_t* row) const {
        const std::int32_t* mean = means_.data() + t * stride_ + kPadding + j;
        const std::int32_t* last = last_.data() + kPadding + j;
        return 2 * mean[0] + mean[-3] + mean[3] + 16 * last[0] + 4 * (last[-3] + last[3]) +
               12 * size(row[static_cast<std::ptrdiff_t>(j) - 3]) +
               8 * (size(row[static_cast<std::ptrdiff_t>(j) - 1]) +
                    size(row[static_cast<std::ptrdiff_t>(j) - 2])) +
               4 * size(row[static_cast<std::ptrdiff_t>(j) - 6]);
    }
    /// Takes up a whole row t, and how much of it was not zero.
    void remember(std::size_t t, const std::int32_t* row, std::int32_t tail);
    /// The tail of row t in the block before; that of the row before in the first block.
    std::int32_t last_tail(std::size_t t) const { return tails_[t]; }

    /// Magnitudes count up to this.
    static constexpr std::uint32_t kLargest = 1 << 16;
    static std::int32_t size(std::int32_t level) {
        const auto value = static_cast<std::uint32_t>(level);
        const std::uint32_t magnitude = level < 0 ? 0u - value : value;
        return static_cast<std::int32_t>(magnitude < kLargest ? magnitude : kLargest);
    }
    static constexpr std::size_t kPadding = 6;

 private:
    std::size_t stride_;
    std::vector<std::int32_t> means_;  // of each row of a block: running mean of magnitudes, sixteenths
    std::vector<std::int32_t> last_;   // magnitudes of the row coded last
    std::vector<std::int32_t> first_;  // of the first row of the last block
    std::vector<std::int32_t> tails_;
    std::size_t started_ = 0;  // rows of a block that have a mean
};

/// Contexts of the rows in one stream.
class RowContexts {
 public:
    static constexpr int kClasses = 44;
    /// Class of an expectation: about twice its binary logarithm.
    static int class_of(std::int32_t expectation);

    IntegerModel& of(std::int32_t expectation) {
        const auto c = static_cast<std::size_t>(class_of(expectation));
        return models_[c] ? *models_[c] : make(c);
    }
    IntegerModel& tail(std::int32_t last) { return tails_[static_cast<std::size_t>(last)]; }

 private:
    IntegerModel& make(std::size_t c);
    std::array<std::unique_ptr<IntegerModel>, kClasses> models_;
    std::array<IntegerModel, 9> tails_;
};

/// A row's tail: eighths of its columns, rounded up, that hold all levels but zeros, 0 … 8.
std::int32_t tail_of(std::span<const std::int32_t> row);
/// Levels of a row of `levels` before its tail ends; a multiple of three.
inline std::size_t tail_end(std::size_t levels, std::int32_t tail) {
    return (levels / 3 * static_cast<std::size_t>(tail) + 7) / 8 * 3;
}

/// Codes row t of a block. row: 3n levels, kPadding zeros stand before them.
void encode_row(RangeEncoder& encoder, RowContexts& contexts, RowMemory& memory, std::size_t t,
                std::span<const std::int32_t> row);
/// The way back; the padding before `row` is zero, the row itself anything. False when the stream is seen to
/// be corrupt.
bool decode_row(RangeDecoder& decoder, RowContexts& contexts, RowMemory& memory, std::size_t t,
                std::span<std::int32_t> row);

/// Bits that a level is thought to cost at an expectation; for choices of encoders.
float level_cost(std::int32_t expectation, std::int32_t level);

}  // namespace batchenc
