#include "kernels/bit_coder.h"

#include <algorithm>
#include <bit>

namespace batchenc {
namespace {

constexpr int kUnit = 256;
constexpr std::uint32_t kCountMask = 1023;
constexpr std::uint32_t kCountLimit = 1000;     // an AdaptiveBit remembers about as many bits
constexpr int kRateShift = 14;                  // of the weights: how slowly they learn
constexpr std::int32_t kFirstWeight = 1 << 14;  // a quarter
constexpr int kConstant = kUnit / 2;            // the input that is always there

/// e^x for x >= 0, by its series on a small part of x, squared back: one result on every machine.
constexpr double exponential(double x) {
    const double small = x / 64.0;
    double term = 1.0, sum = 1.0;
    for (int k = 1; k < 12; ++k) {
        term = term * small / k;
        sum += term;
    }
    for (int k = 0; k < 6; ++k) sum *= sum;
    return sum;
}

constexpr auto make_squash_table() {
    std::array<std::uint16_t, 2 * kLogisticLimit + 1> table{};
    for (int x = -kLogisticLimit; x <= kLogisticLimit; ++x) {
        const double e = exponential(static_cast<double>(x < 0 ? -x : x) / kUnit);
        const double p = 65536.0 * (x < 0 ? 1.0 / (1.0 + e) : e / (1.0 + e));
        const int rounded = static_cast<int>(p + 0.5);
        table[static_cast<std::size_t>(x + kLogisticLimit)] =
            static_cast<std::uint16_t>(rounded < 1       ? 1
                                       : rounded > 65535 ? 65535
                                                         : rounded);
    }
    return table;
}
constexpr auto kSquash = make_squash_table();

constexpr auto make_stretch_table() {  // the smallest x whose squash reaches the middle of each 4096th
    std::array<std::int16_t, 4096> table{};
    int x = -kLogisticLimit;
    for (std::uint32_t p = 0; p < 4096; ++p) {
        while (x < kLogisticLimit && kSquash[static_cast<std::size_t>(x + kLogisticLimit)] < 16 * p + 8) ++x;
        table[p] = static_cast<std::int16_t>(x);
    }
    return table;
}
constexpr auto kStretch = make_stretch_table();

constexpr auto make_reciprocals() {
    std::array<std::uint32_t, kCountLimit + 1> table{};
    for (std::uint32_t n = 0; n <= kCountLimit; ++n)
        table[n] = static_cast<std::uint32_t>(65536.0 / (n + 1.6));
    return table;
}
constexpr auto kReciprocal = make_reciprocals();

// What is called for every bit, where the compiler sees that it is small.
inline std::uint32_t squash_of(int x) {
    return kSquash[static_cast<std::size_t>(std::clamp(x, -kLogisticLimit, kLogisticLimit) + kLogisticLimit)];
}

inline std::uint32_t learnt(std::uint32_t state, bool bit) {
    const std::uint32_t count = state & kCountMask;
    const auto p = static_cast<std::int32_t>(state >> 10);
    const std::int32_t target = bit ? (1 << 22) - 1 : 0;
    const auto moved = static_cast<std::int32_t>((std::int64_t{target - p} * kReciprocal[count]) >> 16);
    return (static_cast<std::uint32_t>(p + moved) << 10) | std::min(count + 1, kCountLimit);
}

}  // namespace

BitCoder::BitCoder(std::span<const std::uint8_t> bytes) : is_decoder_(true), bytes_(bytes) {
    for (int k = 0; k < 4; ++k) {
        window_ = (window_ << 8) | (at_ < bytes_.size() ? bytes_[at_] : 0u);
        at_ < bytes_.size() ? ++at_ : ++overrun_;
    }
}

void BitCoder::shift() {
    if (is_decoder_) {
        window_ = (window_ << 8) | (at_ < bytes_.size() ? bytes_[at_] : 0u);
        at_ < bytes_.size() ? ++at_ : ++overrun_;
    } else {
        written_.push_back(static_cast<std::uint8_t>(high_ >> 24));
    }
    low_ <<= 8;
    high_ = (high_ << 8) | 0xffu;
}

std::uint8_t BitCoder::last_byte() const {
    // The first bytes of low and high differ, so that the next one above low is enough, and none where low is
    // zero.
    return static_cast<std::uint8_t>((low_ >> 24) + ((low_ & 0xffffffu) != 0 ? 1 : 0));
}

std::vector<std::uint8_t> BitCoder::finish() {
    if (const std::uint8_t last = last_byte(); last != 0) written_.push_back(last);
    return std::move(written_);
}

Expected<void> BitCoder::check_end() const {
    const std::size_t behind = at_ + overrun_ - kLookahead;  // bytes that are no longer in the window
    const std::uint8_t last = last_byte();
    if (bytes_.size() != behind + (last != 0 ? 1 : 0) || window_ != std::uint32_t{last} << 24)
        return fail(ErrorCode::kCorrupt, "a coded stream does not end where its values do");
    return {};
}

std::uint32_t squash(int x) { return squash_of(x); }

int stretch(std::uint32_t probability) { return kStretch[probability]; }

void AdaptiveBit::learn(bool bit) { state_ = learnt(state_, bit); }

MixedBits::MixedBits(std::span<const std::size_t> context_counts, std::size_t set_count)
    : inputs_(context_counts.size() + 1), weights_(set_count * (context_counts.size() + 1), kFirstWeight) {
    std::size_t total = 0;
    for (const std::size_t count : context_counts) {
        first_.push_back(total);
        total += count;
    }
    bits_.resize(total);
    for (std::size_t set = 0; set < set_count; ++set) weights_[(set + 1) * inputs_ - 1] = 0;
}

bool MixedBits::code(BitCoder& coder, bool bit, std::span<const std::size_t> contexts, std::size_t set) {
    std::array<AdaptiveBit*, kMostContexts> sources;
    std::array<std::int32_t, kMostContexts + 1> inputs;
    std::int32_t* weights = weights_.data() + set * inputs_;
    std::int64_t sum = 0;
    for (std::size_t i = 0; i + 1 < inputs_; ++i) {
        sources[i] = &bits_[first_[i] + contexts[i]];
        inputs[i] = kStretch[sources[i]->probability12()];
        sum += std::int64_t{weights[i]} * inputs[i];
    }
    inputs[inputs_ - 1] = kConstant;
    sum += std::int64_t{weights[inputs_ - 1]} * kConstant;
    const auto mixed = static_cast<int>(std::clamp<std::int64_t>(sum >> 16, -kLogisticLimit, kLogisticLimit));
    const std::uint32_t probability = squash_of(mixed);
    bit = coder.code(bit, probability);

    const std::int32_t error = (bit ? 65536 : 0) - static_cast<std::int32_t>(probability);
    constexpr std::int32_t kLargestWeight = 1 << 20;
    for (std::size_t i = 0; i < inputs_; ++i) {
        weights[i] =
            std::clamp(weights[i] + ((inputs[i] * error) >> kRateShift), -kLargestWeight, kLargestWeight);
    }
    for (std::size_t i = 0; i + 1 < inputs_; ++i) sources[i]->state_ = learnt(sources[i]->state_, bit);
    return bit;
}

bool code_bit(BitCoder& coder, AdaptiveBit& context, bool bit) {
    const std::uint32_t probability = std::clamp<std::uint32_t>(context.probability(), 1, 65535);
    bit = coder.code(bit, probability);
    context.learn(bit);
    return bit;
}

AdaptiveNumber::AdaptiveNumber(std::uint32_t largest)
    : digits_(static_cast<int>(std::bit_width(largest))), bits_(std::size_t{1} << digits_) {}

std::uint32_t AdaptiveNumber::code(BitCoder& coder, std::uint32_t value) {
    std::size_t node = 1;
    for (int k = digits_; k-- > 0;)
        node = 2 * node + (code_bit(coder, bits_[node], ((value >> k) & 1) != 0) ? 1 : 0);
    return static_cast<std::uint32_t>(node - bits_.size());
}

std::uint64_t AdaptiveCount::code(BitCoder& coder, std::uint64_t value) {
    // value + 1 has `digits` binary digits behind its leading one.
    const int wanted = static_cast<int>(std::bit_width(value + 1)) - 1;
    int digits = 0;
    while (digits + 1 < kMostDigits &&
           code_bit(coder, length_[static_cast<std::size_t>(digits)], wanted > digits))
        ++digits;
    std::uint64_t number = 1;
    std::size_t node = 1;
    for (int k = digits; k-- > 0;) {
        const bool digit = (((value + 1) >> k) & 1) != 0;
        bool coded;
        if (node < 4) {
            coded = code_bit(coder, leading_[static_cast<std::size_t>(digits)][node], digit);
            node = 2 * node + (coded ? 1 : 0);
        } else {
            coded = coder.code(digit, 1u << 15);
        }
        number = 2 * number + (coded ? 1 : 0);
    }
    return number - 1;
}

}  // namespace batchenc
