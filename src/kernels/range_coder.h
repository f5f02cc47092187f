#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <span>
#include <utility>
#include <vector>

#include "core/error.h"

namespace batchenc {

// Adaptive range coding of signed integers, in its asymmetric-numeral form (rANS: J. Duda, "Asymmetric
// numeral systems", 2013; word-wise renormalisation, two interleaved states).
//
// A value is coded as a token (small values one by one, larger ones in eighths of an octave, by sign)
// followed by the plain bits that tell it from its neighbours in the same eighth. Tokens are coded with an
// adaptive model; a token that the model has not seen yet is announced by an escape. Every int32 can be
// coded.

/// How integers map to tokens. Tokens 0 … 14 are the values -7 … 7; then, octave by octave from 8 to 65535,
/// eighth by eighth, a token for the positive and one for the negative values.
struct IntegerTokens {
    static constexpr int kDirect = 7;  ///< largest magnitude with a token of its own
    static constexpr int kFirstOctave = 3;
    static constexpr int kLastOctave = 15;
    static constexpr int kEscape = 2 * kDirect + 1 + 16 * (kLastOctave - kFirstOctave + 1);
    static constexpr int kCount = kEscape + 1;
    static constexpr int kLargeMark =
        255;  ///< after an escape: 32 plain bits follow instead of a token's number

    struct Token {
        std::int32_t base;   ///< value whose plain bits are all zero
        std::int32_t sign;   ///< 0, or -1 where plain bits count downwards
        std::uint32_t bits;  ///< number of plain bits
    };
    /// All tokens but the escape.
    static const std::array<Token, kCount> kTable;

    /// Token of a value; kEscape for magnitudes from 65536.
    static int of(std::int32_t value) {
        const std::uint32_t magnitude =
            value < 0 ? 0u - static_cast<std::uint32_t>(value) : static_cast<std::uint32_t>(value);
        if (magnitude <= kDirect) return value + kDirect;
        const int octave = 31 - __builtin_clz(magnitude);
        if (octave > kLastOctave) return kEscape;
        const int eighth = static_cast<int>(magnitude >> (octave - 3)) - 8;
        return 2 * kDirect + 1 + 16 * (octave - kFirstOctave) + 2 * eighth + (value < 0 ? 1 : 0);
    }
};

/// Statistics of one context: counts of tokens, and frequencies derived from them at fixed moments. Encoder
/// and decoder hold one each and change it in step. About 6 KiB; made once a context and stream, never inside
/// a loop.
class IntegerModel {
 public:
    static constexpr int kFrequencyBits = 12;

    /// expected_magnitude: what the mean absolute value is thought to be; the model starts with a two-sided
    /// geometric distribution of that mean and forgets it as it learns. Negative: no idea, every token starts
    /// unseen. Both sides must pass the same double; it enters + - * / and sqrt only, so that every machine
    /// gets the same model.
    explicit IntegerModel(double expected_magnitude = -1.0);

 private:
    friend class RangeEncoder;
    friend class RangeDecoder;

    /// Derives frequencies from counts: at first soon, then ever more rarely.
    void update_frequencies();
    void update_lookup();
    void count(int token) {
        counts_[static_cast<std::size_t>(token)] += kCountStep;
        --until_update_;
    }
    /// Counts a token that an escape announced. One value is one step towards the next update, and a new
    /// token is a reason not to wait for it so long.
    void count_unseen(int token) {
        counts_[static_cast<std::size_t>(token)] += kCountStep;
        until_update_ /= 2;
    }

    static constexpr std::uint32_t kCountStep =
        32;  // counts are in 32nds, so that a prior can weigh less than one symbol

    std::int32_t until_update_ = 0;
    std::int32_t interval_ = 1;
    std::array<std::uint32_t, IntegerTokens::kCount> counts_{};
    std::array<std::uint16_t, IntegerTokens::kCount> frequency_{};  // of 2^kFrequencyBits
    std::array<std::uint16_t, IntegerTokens::kCount>
        cumulative_{};  // sum of the frequencies of the tokens before
    static constexpr std::size_t kRun =
        16;  // bytes that update_lookup() writes at once, perhaps beyond the table's end
    std::array<std::uint8_t, (1 << kFrequencyBits) + kRun> lookup_;  // slot -> token; kept by decoders only
};

/// Codes integers into memory. Values are modelled as they come and written backwards by finish().
class RangeEncoder {
 public:
    /// Makes room for so many values, so that none of what is coded has to move.
    void reserve(std::size_t count) { steps_.reserve(count); }
    /// Codes one value in the context `model`.
    void encode(IntegerModel& model, std::int32_t value);
    /// What the values coded since the last finish() take, in bits; without the 9 bytes or so that ending a
    /// stream costs. Within a percent of what finish() makes of them.
    double size_bits() const;
    /// Ends the stream and gives its bytes (none when nothing was coded); the encoder may then be used again.
    std::vector<std::uint8_t> finish();

 private:
    struct Step {
        std::uint16_t cumulative, frequency;
    };
    /// The model's frequencies are up to date.
    void put_token(IntegerModel& model, int token) {
        const auto t = static_cast<std::size_t>(token);
        steps_.push_back({model.cumulative_[t], model.frequency_[t]});
        model.count(token);
    }
    void put_bits(std::uint32_t bits, unsigned count) {
        plain_pending_ |= std::uint64_t{bits} << plain_count_;
        plain_count_ += count;
        if (plain_count_ >= 32) flush_plain();
    }
    void flush_plain();

    std::vector<Step> steps_;
    std::vector<std::uint8_t> plain_;
    std::uint64_t plain_pending_ = 0;
    unsigned plain_count_ = 0;
};

/// Decodes what RangeEncoder wrote. Bytes that it did not write give arbitrary values, never a read outside
/// them; finish() then says so.
class RangeDecoder {
 public:
    /// Error kCorrupt when the bytes cannot be a stream. The bytes must outlive the decoder.
    static Expected<RangeDecoder> open(std::span<const std::uint8_t> bytes);

    /// Next value in the context `model`.
    std::int32_t decode(IntegerModel& model);
    /// Error kCorrupt unless exactly the whole stream has been decoded.
    Expected<void> finish() const;

 private:
    RangeDecoder() = default;
    int get_token(IntegerModel& model);
    std::uint32_t get_bits(unsigned count);
    void refill_plain();

    static constexpr std::uint32_t kLowest = 1u << 16;  // states live in [kLowest, 2^32)
    friend class RangeEncoder;

    std::uint32_t state_ = kLowest;       // the one whose turn it is
    std::uint32_t next_state_ = kLowest;  // the other
    const std::uint8_t* words_ = nullptr;
    const std::uint8_t* words_end_ = nullptr;
    const std::uint8_t* plain_ = nullptr;
    const std::uint8_t* plain_end_ = nullptr;
    std::uint64_t plain_pending_ = 0;
    unsigned plain_count_ = 0;
    bool overrun_ = false;
};

/// Most integers that a stream of `size_bytes` can hold: each costs at least log2(4096/4095) bits. A decoder
/// checks a count against it before it allocates.
std::uint64_t max_symbol_count(std::uint64_t size_bytes);

// The decoding loop is written into the header so that a caller's loop keeps the decoder in registers.

inline int RangeDecoder::get_token(IntegerModel& model) {
    if (model.until_update_ == 0) {
        model.update_frequencies();
        model.update_lookup();
    }
    const std::uint32_t slot = state_ & ((1u << IntegerModel::kFrequencyBits) - 1);
    const int token = model.lookup_[slot];
    const auto t = static_cast<std::size_t>(token);
    std::uint32_t state =
        model.frequency_[t] * (state_ >> IntegerModel::kFrequencyBits) + slot - model.cumulative_[t];
    if (state < kLowest) {
        if (words_ == words_end_) {
            overrun_ = true;
            state = kLowest;
        } else {
            std::uint16_t word;
            std::memcpy(&word, words_, 2);
            words_ += 2;
            state = (state << 16) | word;
        }
    }
    state_ = std::exchange(next_state_, state);
    model.count(token);
    return token;
}

inline void RangeDecoder::refill_plain() {
    if (plain_end_ - plain_ >= 8) {
        std::uint64_t chunk;
        std::memcpy(&chunk, plain_, 8);
        plain_pending_ |= chunk << plain_count_;
        const unsigned taken = (63 - plain_count_) / 8;
        plain_ += taken;
        plain_count_ += 8 * taken;
        plain_pending_ &= (~std::uint64_t{0}) >> (64 - plain_count_);
        return;
    }
    while (plain_count_ <= 56 && plain_ != plain_end_) {
        plain_pending_ |= std::uint64_t{*plain_++} << plain_count_;
        plain_count_ += 8;
    }
}

inline std::uint32_t RangeDecoder::get_bits(unsigned count) {
    if (plain_count_ < count) {
        refill_plain();
        if (plain_count_ < count) {
            overrun_ = true;
            plain_count_ = count;  // the missing bits read as zero
        }
    }
    const auto bits = static_cast<std::uint32_t>(plain_pending_ & ((std::uint64_t{1} << count) - 1));
    plain_pending_ >>= count;
    plain_count_ -= count;
    return bits;
}

inline std::int32_t RangeDecoder::decode(IntegerModel& model) {
    int token = get_token(model);
    if (token == IntegerTokens::kEscape) [[unlikely]] {
        token = static_cast<int>(get_bits(8));
        if (token == IntegerTokens::kLargeMark) return static_cast<std::int32_t>(get_bits(32));
        if (token >= IntegerTokens::kEscape) {
            overrun_ = true;
            return 0;
        }
        model.count_unseen(token);
    }
    const IntegerTokens::Token& form = IntegerTokens::kTable[static_cast<std::size_t>(token)];
    const auto plain = static_cast<std::int32_t>(get_bits(form.bits));
    return form.base + ((plain ^ form.sign) - form.sign);
}

}  // namespace batchenc
