#include "codecs/level_rows.h"

#include <algorithm>
#include <cmath>

namespace batchenc {
namespace {

/// Sum of the weights in RowMemory::expectation, per unit of magnitude everywhere.
constexpr double kWeights = 128.0;
constexpr int kCostLevels = 16;

/// The mean magnitude that a class stands for.
double magnitude_of_class(int c) {
    return c == 0 ? 0.01 : std::ldexp(c % 2 == 0 ? 1.0 : 1.4142135623730951, c / 2) / kWeights;
}

struct CostTable {
    std::array<std::array<float, kCostLevels>, RowContexts::kClasses> bits;
    std::array<float, RowContexts::kClasses> slope;  // bits a unit beyond the table

    CostTable() {
        for (int c = 0; c < RowContexts::kClasses; ++c) {
            // A two-sided geometric distribution whose mean magnitude is m: 2 r / (1 - r^2) = m.
            const double m = magnitude_of_class(c);
            const double r = (std::sqrt(1.0 + m * m) - 1.0) / m;
            for (int level = 0; level < kCostLevels; ++level)
                bits[static_cast<std::size_t>(c)][static_cast<std::size_t>(level)] =
                    static_cast<float>(-std::log2((1.0 - r) / (1.0 + r)) - level * std::log2(r));
            slope[static_cast<std::size_t>(c)] = static_cast<float>(-std::log2(r));
        }
    }
};

}  // namespace

RowMemory::RowMemory(std::int64_t columns, std::int64_t rows)
    : stride_(static_cast<std::size_t>(3 * columns) + 2 * kPadding),
      means_(stride_ * static_cast<std::size_t>(rows)),
      last_(stride_),
      first_(stride_),
      tails_(static_cast<std::size_t>(rows), 0) {}

void RowMemory::remember(std::size_t t, const std::int32_t* row, std::int32_t tail) {
    const std::size_t levels = stride_ - 2 * kPadding;
    std::int32_t* mean = means_.data() + t * stride_ + kPadding;
    std::int32_t* last = last_.data() + kPadding;
    for (std::size_t j = 0; j < levels; ++j) {
        const std::int32_t magnitude = size(row[j]);
        mean[j] += (16 * magnitude - mean[j] + 2) >> 2;
        last[j] = magnitude;
    }
    tails_[t] = tail;
    const std::size_t rows = tails_.size();
    if (t + 1 < rows && started_ == t) {
        std::copy_n(mean, levels, mean + stride_);
        tails_[t + 1] = tail;
        ++started_;
    }
    if (rows == 1) return;
    if (t == 0) first_ = last_;
    if (t + 1 == rows) last_ = first_;
}

int RowContexts::class_of(std::int32_t expectation) {
    if (expectation <= 0) return 0;
    const auto x = static_cast<std::uint64_t>(expectation);
    const int c = 63 - __builtin_clzll(x * x);  // twice the logarithm, rounded down
    return std::min(1 + c, kClasses - 1);
}

IntegerModel& RowContexts::make(std::size_t c) {
    models_[c] = std::make_unique<IntegerModel>(magnitude_of_class(static_cast<int>(c)));
    return *models_[c];
}

std::int32_t tail_of(std::span<const std::int32_t> row) {
    std::size_t used = row.size();
    while (used > 0 && row[used - 1] == 0) --used;
    if (used == 0) return 0;
    std::int32_t tail = 1;
    while (tail_end(row.size(), tail) < used) ++tail;
    return tail;
}

void encode_row(RangeEncoder& encoder, RowContexts& contexts, RowMemory& memory, std::size_t t,
                std::span<const std::int32_t> row) {
    const std::int32_t tail = tail_of(row);
    encoder.encode(contexts.tail(memory.last_tail(t)), tail);
    const std::size_t end = tail_end(row.size(), tail);
    for (std::size_t j = 0; j < end; ++j)
        encoder.encode(contexts.of(memory.expectation(t, j, row.data())), row[j]);
    memory.remember(t, row.data(), tail);
}

bool decode_row(RangeDecoder& shared_decoder, RowContexts& contexts, RowMemory& memory, std::size_t t,
                std::span<std::int32_t> row) {
    RangeDecoder decoder = shared_decoder;  // a local copy stays in registers
    const std::int32_t tail = decoder.decode(contexts.tail(memory.last_tail(t)));
    if (tail < 0 || tail > 8) return false;
    const std::size_t end = tail_end(row.size(), tail);
    for (std::size_t j = 0; j < end; ++j)
        row[j] = decoder.decode(contexts.of(memory.expectation(t, j, row.data())));
    std::fill(row.begin() + static_cast<std::ptrdiff_t>(end), row.end(), 0);
    memory.remember(t, row.data(), tail);
    shared_decoder = decoder;
    return true;
}

float level_cost(std::int32_t expectation, std::int32_t level) {
    static const CostTable table;
    const auto c = static_cast<std::size_t>(RowContexts::class_of(expectation));
    const std::int32_t magnitude = RowMemory::size(level);
    if (magnitude < kCostLevels) return table.bits[c][static_cast<std::size_t>(magnitude)];
    return table.bits[c][kCostLevels - 1] +
           table.slope[c] * static_cast<float>(magnitude - (kCostLevels - 1));
}

}  // namespace batchenc
