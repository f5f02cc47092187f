#include "codecs/level_rows.h"

#include <cmath>

namespace batchenc {
namespace {

constexpr double kWeightUnit = 512.0;

/// The mean magnitude that a class stands for.
double magnitude_of_class(std::size_t c) {
    if (c == 0) return 0.001;
    const double middle = c % 2 == 1 ? 1.25 : 1.75;
    return std::ldexp(middle, static_cast<int>(c - 1) / 2) / kWeightUnit;
}

}  // namespace

// Weights: least squares over the levels of chicken, dance, cowheavy and samba, errors relative to what is
// expected. Rows of a time of their own are told apart from rows that are transformed along time.
RowMemory::RowMemory(std::int64_t columns, std::int64_t rows)
    : levels_(static_cast<std::size_t>(3 * columns)),
      rows_(static_cast<std::size_t>(rows)),
      weights_(rows == 1 ? Weights{10, 10, 28, {31, 25, 72, 8, 49}}
                         : Weights{5, 75, 5, {50, 33, 95, 10, 70}}),
      means_(levels_ * rows_),
      last_(levels_ + 2 * kPadding),
      first_(rows > 1 ? levels_ + 2 * kPadding : 0),
      sizes_(levels_ + 2 * kPadding),
      past_(levels_),
      classes_(levels_),
      tails_(rows_, 0) {}

void RowMemory::begin(std::size_t t) {
    const std::int32_t* mean = means_.data() + t * levels_;
    const std::int32_t* last = last_.data() + kPadding;
    std::int32_t* past = past_.data();
    const Weights weights = weights_;
    for (std::size_t j = 0; j < levels_; ++j) {
        past[j] = weights.mean * mean[j] + weights.last * last[j] +
                  weights.beside * (last[static_cast<std::ptrdiff_t>(j) - 3] + last[j + 3]);
    }
}

std::span<const std::uint8_t> RowMemory::classes_of(std::span<const std::int32_t> row) {
    std::int32_t* sizes = sizes_.data() + kPadding;
    for (std::size_t j = 0; j < levels_; ++j) sizes[j] = size_of(row[j]);
    for (std::size_t j = 0; j < levels_; ++j)
        classes_[j] = static_cast<std::uint8_t>(RowContexts::class_of(expectation(j)));
    return classes_;
}

void RowMemory::end(std::size_t t, std::int32_t tail) {
    std::int32_t* mean = means_.data() + t * levels_;
    const std::int32_t* sizes = sizes_.data() + kPadding;
    for (std::size_t j = 0; j < levels_; ++j) mean[j] += (16 * sizes[j] - mean[j] + 2) >> 2;
    tails_[t] = tail;
    if (t + 1 < rows_ && started_ == t) {
        std::copy_n(mean, levels_, mean + levels_);
        tails_[t + 1] = tail;
        ++started_;
    }
    std::copy_n(sizes, levels_, last_.begin() + kPadding);
    if (rows_ == 1) return;
    if (t == 0) first_ = last_;
    if (t + 1 == rows_) last_ = first_;
}

IntegerModel& RowContexts::make(std::size_t c) {
    models_[c] = std::make_unique<IntegerModel>(magnitude_of_class(c));
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
    memory.begin(t);
    const std::span<const std::uint8_t> classes = memory.classes_of(row);
    for (std::size_t j = 0; j < end; ++j) encoder.encode(contexts.of_class(classes[j]), row[j]);
    memory.end(t, tail);
}

bool decode_row(RangeDecoder& shared_decoder, RowContexts& contexts, RowMemory& memory, std::size_t t,
                std::span<std::int32_t> row) {
    RangeDecoder decoder = shared_decoder;  // a local copy stays in registers
    const std::int32_t tail = decoder.decode(contexts.tail(memory.last_tail(t)));
    if (tail < 0 || tail > 8) return false;
    const std::size_t end = tail_end(row.size(), tail);
    memory.begin(t);
    for (std::size_t j = 0; j < end; ++j) {
        row[j] = decoder.decode(contexts.of_class(RowContexts::class_of(memory.expectation(j))));
        memory.set(j, row[j]);
    }
    std::fill(row.begin() + static_cast<std::ptrdiff_t>(end), row.end(), 0);
    memory.clear_from(end);
    memory.end(t, tail);
    shared_decoder = decoder;
    return true;
}

const LevelCosts& LevelCosts::get() {
    static const LevelCosts costs;
    return costs;
}

LevelCosts::LevelCosts() {
    for (std::size_t c = 0; c < RowContexts::kClasses; ++c) {
        // A two-sided geometric distribution whose mean magnitude is m: 2 r / (1 - r^2) = m.
        const double m = magnitude_of_class(c);
        const double r = (std::sqrt(1.0 + m * m) - 1.0) / m;
        for (int level = 0; level < kTabled; ++level)
            rows_[c].bits[static_cast<std::size_t>(level)] =
                static_cast<float>(-std::log2((1.0 - r) / (1.0 + r)) - level * std::log2(r));
        rows_[c].slope = static_cast<float>(-std::log2(r));
    }
}

}  // namespace batchenc
