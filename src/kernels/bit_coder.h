#pragma once

#include <array>
#include <cstdint>
#include <initializer_list>
#include <span>
#include <vector>

#include "core/error.h"

namespace batchenc {

// Binary arithmetic coding under mixed contexts, for what there is little of but every bit counts
// (connectivity, order). Every probability comes from integer arithmetic and tables made of + - * / alone, so
// that encoder and decoder agree on every machine.

/// Codes bits in either direction, so that one function can describe a stream for both sides: code(bit, p)
/// writes `bit` when encoding, and returns what was written when decoding (carry-less range coding, cf. G. N.
/// N. Martin, "Range encoding", 1979).
class BitCoder {
 public:
    /// For encoding.
    BitCoder() = default;
    /// For decoding; `bytes` outlives the object.
    explicit BitCoder(std::span<const std::uint8_t> bytes);

    bool is_decoder() const { return is_decoder_; }
    /// one_probability: of 65536, 1 … 65535. The bit is looked at when encoding only.
    bool code(bool bit, std::uint32_t one_probability) {
        const std::uint32_t middle =
            low_ + static_cast<std::uint32_t>((std::uint64_t{high_ - low_} * one_probability) >> 16);
        if (is_decoder_) bit = window_ <= middle;
        if (bit)
            high_ = middle;
        else
            low_ = middle + 1;
        while (((low_ ^ high_) & 0xff000000u) == 0) shift();
        return bit;
    }
    /// Encoding: ends the stream and gives its bytes; empty where no bit was coded.
    std::vector<std::uint8_t> finish();
    /// Decoding: whether more was read than there is. A stream that ends early gives zeros; loops ask this.
    bool is_overrun() const { return overrun_ > kLookahead; }
    /// Decoding: error kCorrupt unless the bytes are what finish gives for the bits that were read.
    Expected<void> check_end() const;

 private:
    static constexpr std::size_t kLookahead = 4;  // bytes of the window that a whole stream may lack
    void shift();
    /// What ends the stream, followed by zeros that are not there; 0: nothing does.
    std::uint8_t last_byte() const;

    bool is_decoder_ = false;
    std::uint32_t low_ = 0, high_ = 0xffffffffu;
    std::uint32_t window_ = 0;
    std::vector<std::uint8_t> written_;
    std::span<const std::uint8_t> bytes_;
    std::size_t at_ = 0, overrun_ = 0;
};

/// Fixed-point logistic functions; 256 parts of a unit.
inline constexpr int kLogisticLimit = 2815;  ///< almost 11 units
/// 65536 / (1 + e^-x), 1 … 65535; x in parts, clamped to the limit.
std::uint32_t squash(int x);
/// ln(p / (1 - p)) in parts, of a probability of 4096.
int stretch(std::uint32_t probability);

/// How likely a one is in one context, learnt from the bits seen there: their mean at first, then an
/// exponential mean.
class AdaptiveBit {
 public:
    /// In 65536ths.
    std::uint32_t probability() const { return state_ >> 16; }
    std::uint32_t probability12() const { return state_ >> 20; }
    void learn(bool bit);

 private:
    friend class MixedBits;
    std::uint32_t state_ = 1u << 31;  // 22 bits of probability, 10 of a count
};

/// Bits of one kind, each coded under several contexts at once: every context has its own AdaptiveBit, and
/// what they say is mixed in the logistic domain by weights that are learnt on the way (cf. M. Mahoney,
/// "Adaptive weighing of context models for lossless data compression", 2005).
class MixedBits {
 public:
    static constexpr std::size_t kMostContexts = 8;

    /// context_counts: how many values each of up to kMostContexts contexts takes. set_count: sets of
    /// weights.
    MixedBits(std::span<const std::size_t> context_counts, std::size_t set_count);
    MixedBits(std::initializer_list<std::size_t> context_counts, std::size_t set_count)
        : MixedBits(std::span(context_counts.begin(), context_counts.size()), set_count) {}

    /// contexts: as many as there are counts, each below its count. set: below set_count.
    bool code(BitCoder& coder, bool bit, std::span<const std::size_t> contexts, std::size_t set);
    bool code(BitCoder& coder, bool bit, std::initializer_list<std::size_t> contexts, std::size_t set) {
        return code(coder, bit, std::span(contexts.begin(), contexts.size()), set);
    }

 private:
    std::size_t inputs_;  // contexts and a constant
    std::vector<std::size_t> first_;
    std::vector<AdaptiveBit> bits_;
    std::vector<std::int32_t> weights_;  // 16 fractional bits
};

/// Non-negative integers in one context: number of binary digits in unary, then the digits, the two leading
/// ones modelled.
class AdaptiveCount {
 public:
    /// Values below 2^40.
    std::uint64_t code(BitCoder& coder, std::uint64_t value);

 private:
    static constexpr int kMostDigits = 41;
    std::array<AdaptiveBit, kMostDigits> length_;
    std::array<std::array<AdaptiveBit, 4>, kMostDigits> leading_;
};

/// Numbers of a fixed count of digits, such as choices among a few, in one context: digit by digit, each
/// after those before it.
class AdaptiveNumber {
 public:
    /// largest: of the numbers. A corrupt stream may give any of as many digits.
    explicit AdaptiveNumber(std::uint32_t largest);
    std::uint32_t code(BitCoder& coder, std::uint32_t value);

 private:
    int digits_;
    std::vector<AdaptiveBit> bits_;
};

/// One bit in one context.
bool code_bit(BitCoder& coder, AdaptiveBit& context, bool bit);

}  // namespace batchenc
