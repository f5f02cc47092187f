#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "kernels/range_coder.h"

namespace batchenc {

// Rows of quantised transform coefficients ("levels") as coded integers: three values a column, rows of one
// cluster one after another, several clusters in a stream. What a level is likely to be follows from the
// magnitudes around it, in the same row and in the rows before; all of it integers, so that both sides agree.

/// Magnitudes around the row that is being coded, of one cluster. One object a cluster and side. A row is
/// taken up in this order: begin, for every level expectation and then set, end.
class RowMemory {
 public:
    /// columns: n of every row. rows: rows of a block; row t of a block remembers rows t of those before.
    RowMemory(std::int64_t columns, std::int64_t rows);

    /// Starts row t of a block: weighs what the rows before it say.
    void begin(std::size_t t);
    /// The expectation for level j (3 × column + coordinate), of which all before it in the row are set: a
    /// weighted sum of magnitudes, in 512ths, 0 … 2^25.
    std::int32_t expectation(std::size_t j) const {
        const std::int32_t* size = sizes_.data() + kPadding + j;
        return past_[j] + weights_.before[0] * size[-1] + weights_.before[1] * size[-2] +
               weights_.before[2] * size[-3] + weights_.before[3] * (size[-4] + size[-5]) +
               weights_.before[4] * size[-6];
    }
    void set(std::size_t j, std::int32_t level) { sizes_[kPadding + j] = size_of(level); }
    /// Ends row t. tail: how much of it was not zero.
    void end(std::size_t t, std::int32_t tail);
    /// The tail of row t in the block before; that of the row before in the first block.
    std::int32_t last_tail(std::size_t t) const { return tails_[t]; }

    /// Sets a whole row, and gives the class (see RowContexts) of each of its levels.
    std::span<const std::uint8_t> classes_of(std::span<const std::int32_t> row);
    /// Sets levels from `first` on to zero.
    void clear_from(std::size_t first) {
        std::fill(sizes_.begin() + static_cast<std::ptrdiff_t>(kPadding + first), sizes_.end(), 0);
    }

 private:
    /// Weights of the magnitudes around a level, in 512ths of its expected magnitude.
    struct Weights {
        std::int32_t mean;                   // of the running mean of this row, which counts sixteenths
        std::int32_t last, beside;           // of the row coded last: at the level, and a column beside it
        std::array<std::int32_t, 5> before;  // of the levels 1, 2, 3, 4 and 5, and 6 before it
    };
    static constexpr std::size_t kPadding = 6;
    static constexpr std::uint32_t kLargest = 1 << 16;  // magnitudes count up to this
    static std::int32_t size_of(std::int32_t level) {
        const auto value = static_cast<std::uint32_t>(level);
        const std::uint32_t magnitude = level < 0 ? 0u - value : value;
        return static_cast<std::int32_t>(magnitude < kLargest ? magnitude : kLargest);
    }

    std::size_t levels_, rows_;  // of a row; of a block
    Weights weights_;
    std::vector<std::int32_t> means_;  // of each row of a block: running mean of magnitudes, sixteenths
    std::vector<std::int32_t> last_;   // magnitudes of the row coded last
    std::vector<std::int32_t> first_;  // of the first row of the last block
    std::vector<std::int32_t> sizes_;  // of the present row, as far as it is set
    std::vector<std::int32_t> past_;   // what the rows before say of it
    std::vector<std::uint8_t> classes_;
    std::vector<std::int32_t> tails_;
    std::size_t started_ = 0;  // rows of a block that have a mean
};

/// Contexts of the rows in one stream.
class RowContexts {
 public:
    static constexpr std::size_t kClasses = 52;
    /// Class of an expectation: two an octave. What it converts is exact, or rounded alike everywhere.
    static std::uint32_t class_of(std::int32_t expectation) {
        constexpr std::uint32_t kClassOfOne = 1, kBitsOfOne = std::bit_cast<std::uint32_t>(1.0f) >> 22;
        const std::uint32_t bits = std::bit_cast<std::uint32_t>(static_cast<float>(expectation)) >> 22;
        return bits == 0 ? 0 : bits - kBitsOfOne + kClassOfOne;
    }

    IntegerModel& of_class(std::size_t c) { return models_[c] ? *models_[c] : make(c); }
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

/// Codes row t of a block. row: 3n levels.
void encode_row(RangeEncoder& encoder, RowContexts& contexts, RowMemory& memory, std::size_t t,
                std::span<const std::int32_t> row);
/// The way back; overwrites `row`. False when the stream is seen to be corrupt.
bool decode_row(RangeDecoder& decoder, RowContexts& contexts, RowMemory& memory, std::size_t t,
                std::span<std::int32_t> row);

/// Bits that levels are thought to cost; for choices of encoders.
class LevelCosts {
 public:
    static const LevelCosts& get();
    /// Of a level of this magnitude where its expectation is of class c.
    float operator()(std::uint32_t c, std::int32_t magnitude) const {
        const Row& row = rows_[c];
        if (magnitude < kTabled) return row.bits[static_cast<std::size_t>(magnitude)];
        return row.bits[kTabled - 1] + row.slope * static_cast<float>(magnitude - (kTabled - 1));
    }

 private:
    LevelCosts();
    static constexpr int kTabled = 15;
    struct Row {
        std::array<float, kTabled> bits;
        float slope;  // bits a unit beyond the table
    };
    std::array<Row, RowContexts::kClasses> rows_;
};

}  // namespace batchenc
