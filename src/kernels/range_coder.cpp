#include "kernels/range_coder.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "kernels/byte_stream.h"

namespace batchenc {
namespace {

constexpr std::uint32_t kTotal = 1u << IntegerModel::kFrequencyBits;
constexpr std::int32_t kFirstInterval =
    16;  // symbols before the first update of a model that starts with a prior
constexpr std::int32_t kLongestInterval = 1024;   // symbols between two updates of a model that has settled
constexpr std::uint32_t kPriorWeight = 128 * 32;  // of the expected distribution, in counts: 128 symbols
constexpr std::uint64_t kCountLimit =
    32ull << 16;  // counts are halved beyond it: about 65,000 symbols are remembered

constexpr std::array<IntegerTokens::Token, IntegerTokens::kCount> make_token_table() {
    std::array<IntegerTokens::Token, IntegerTokens::kCount> table{};
    for (int t = 0; t <= 2 * IntegerTokens::kDirect; ++t)
        table[static_cast<std::size_t>(t)] = {t - IntegerTokens::kDirect, 0, 0};
    for (int t = 2 * IntegerTokens::kDirect + 1; t < IntegerTokens::kEscape; ++t) {
        const int rest = t - (2 * IntegerTokens::kDirect + 1);
        const int shift = rest / 16;
        const int magnitude = (8 + (rest % 16) / 2) << shift;
        const bool negative = rest % 2 == 1;
        table[static_cast<std::size_t>(t)] = {negative ? -magnitude : magnitude, negative ? -1 : 0,
                                              static_cast<std::uint32_t>(shift)};
    }
    return table;
}

double power(double base, int exponent) {  // by multiplication alone: std::pow differs between machines
    double result = 1.0;
    for (; exponent > 0; exponent >>= 1, base *= base) {
        if (exponent & 1) result *= base;
    }
    return result;
}

}  // namespace

const std::array<IntegerTokens::Token, IntegerTokens::kCount> IntegerTokens::kTable = make_token_table();

IntegerModel::IntegerModel(double expected_magnitude) {
    counts_[IntegerTokens::kEscape] = kCountStep;
    if (expected_magnitude < 0.0) return;
    interval_ = kFirstInterval;
    // P(v) ~ ratio^|v| has the mean magnitude 2 ratio / (1 - ratio^2).
    const double m = std::clamp(expected_magnitude, 1e-3, 4e4);
    const double ratio = (std::sqrt(1.0 + m * m) - 1.0) / m;
    const auto prior = [&](double mass) {
        return static_cast<std::uint32_t>(std::floor(mass * kPriorWeight + 0.5));
    };
    counts_[IntegerTokens::kDirect] = prior((1.0 - ratio) / (1.0 + ratio));
    for (int t = 0; t < IntegerTokens::kEscape; ++t) {
        const IntegerTokens::Token& token = IntegerTokens::kTable[static_cast<std::size_t>(t)];
        if (token.base == 0) continue;
        const int first = std::abs(token.base);
        const int width = 1 << token.bits;
        counts_[static_cast<std::size_t>(t)] =
            prior((power(ratio, first) - power(ratio, first + width)) / (1.0 + ratio));
    }
}

void IntegerModel::update_frequencies() {
    std::uint64_t total = 0;
    for (const std::uint32_t c : counts_) total += c;
    if (total > kCountLimit) {
        total = 0;
        for (std::uint32_t& c : counts_) total += c -= c / 2;
    }
    // Cumulative rounding keeps the sum exact; a token that was seen and got nothing takes one from the
    // largest.
    std::uint64_t sum = 0;
    std::uint32_t before = 0;
    std::uint32_t missing = 0;
    // NOLINTNEXTLINE(clang-analyzer-core.DivideZero): the escape is always counted
    const std::uint64_t scale = (std::uint64_t{kTotal} << 32) / total;
    for (std::size_t t = 0; t < counts_.size(); ++t) {
        sum += counts_[t];
        const auto after = static_cast<std::uint32_t>((sum * scale + (std::uint64_t{1} << 31)) >> 32);
        std::uint32_t frequency = after - before;
        before = after;
        if (frequency == 0 && counts_[t] != 0) {
            frequency = 1;
            ++missing;
        }
        frequency_[t] = static_cast<std::uint16_t>(frequency);
    }
    while (missing > 0) {
        auto& largest = *std::max_element(frequency_.begin(), frequency_.end());
        const std::uint32_t taken = std::min<std::uint32_t>(missing, largest / 2u);
        largest = static_cast<std::uint16_t>(largest - taken);
        missing -= taken;
    }
    std::uint32_t cumulative = 0;
    for (std::size_t t = 0; t < counts_.size(); ++t) {
        cumulative_[t] = static_cast<std::uint16_t>(cumulative);
        cumulative += frequency_[t];
    }
    until_update_ = interval_;
    interval_ = std::min(kLongestInterval, interval_ * 2);
}

void IntegerModel::update_lookup() {
    for (std::size_t t = 0; t < counts_.size(); ++t) {
        // Whole runs of a constant size are single stores; what they write too far, the next token writes
        // again.
        for (std::size_t at = 0; at < frequency_[t]; at += kRun) {
            std::memset(lookup_.data() + cumulative_[t] + at, static_cast<int>(t), kRun);
        }
    }
}

void RangeEncoder::flush_plain() {
    for (; plain_count_ >= 8; plain_count_ -= 8, plain_pending_ >>= 8) {
        plain_.push_back(static_cast<std::uint8_t>(plain_pending_));
    }
}

void RangeEncoder::encode(IntegerModel& model, std::int32_t value) {
    const int token = IntegerTokens::of(value);
    if (model.until_update_ == 0) model.update_frequencies();
    if (token == IntegerTokens::kEscape) {
        put_token(model, IntegerTokens::kEscape);
        put_bits(IntegerTokens::kLargeMark, 8);
        put_bits(static_cast<std::uint32_t>(value), 32);
        return;
    }
    if (model.frequency_[static_cast<std::size_t>(token)] == 0) {
        put_token(model, IntegerTokens::kEscape);
        put_bits(static_cast<std::uint32_t>(token), 8);
        model.count_unseen(token);
    } else {
        put_token(model, token);
    }
    const IntegerTokens::Token& form = IntegerTokens::kTable[static_cast<std::size_t>(token)];
    put_bits(static_cast<std::uint32_t>(std::abs(value - form.base)), form.bits);
}

double RangeEncoder::size_bits() const {
    static const std::vector<float> bits_of_frequency = [] {
        std::vector<float> bits(1, 0.0f);
        for (int frequency = 1; frequency <= 1 << IntegerModel::kFrequencyBits; ++frequency)
            bits.push_back(static_cast<float>(IntegerModel::kFrequencyBits - std::log2(frequency)));
        return bits;
    }();
    double bits = 8.0 * static_cast<double>(plain_.size()) + static_cast<double>(plain_count_);
    for (const Step step : steps_) bits += static_cast<double>(bits_of_frequency[step.frequency]);
    return bits;
}

std::vector<std::uint8_t> RangeEncoder::finish() {
    std::vector<std::uint8_t> bytes;
    if (steps_.empty()) return bytes;
    flush_plain();
    if (plain_count_ > 0) plain_.push_back(static_cast<std::uint8_t>(plain_pending_));

    // The decoder's first step is coded last; its states alternate from the first step on.
    std::vector<std::uint16_t> words;
    std::array<std::uint32_t, 2> states = {RangeDecoder::kLowest, RangeDecoder::kLowest};
    for (std::size_t i = steps_.size(); i-- > 0;) {
        const Step step = steps_[i];
        std::uint32_t& state = states[i & 1];
        if (state >= std::uint64_t{step.frequency} << (32 - IntegerModel::kFrequencyBits)) {
            words.push_back(static_cast<std::uint16_t>(state));
            state >>= 16;
        }
        state = ((state / step.frequency) << IntegerModel::kFrequencyBits) + state % step.frequency +
                step.cumulative;
    }
    ByteWriter out;
    out.put_varint(plain_.size());
    out.put(states[0]);
    out.put(states[1]);
    bytes = out.take();
    bytes.reserve(bytes.size() + 2 * words.size() + plain_.size());
    for (std::size_t i = words.size(); i-- > 0;) {
        bytes.push_back(static_cast<std::uint8_t>(words[i]));
        bytes.push_back(static_cast<std::uint8_t>(words[i] >> 8));
    }
    bytes.insert(bytes.end(), plain_.begin(), plain_.end());
    steps_.clear();
    plain_.clear();
    plain_pending_ = 0;
    plain_count_ = 0;
    return bytes;
}

Expected<RangeDecoder> RangeDecoder::open(std::span<const std::uint8_t> bytes) {
    RangeDecoder decoder;
    if (bytes.empty()) return decoder;
    ByteReader reader(bytes);
    const auto plain_size = reader.get_varint(bytes.size());
    if (!plain_size) return tl::unexpected(plain_size.error());
    const auto first = reader.get<std::uint32_t>();
    const auto second = reader.get<std::uint32_t>();
    if (!first || !second || reader.remaining() < *plain_size ||
        (reader.remaining() - *plain_size) % 2 != 0) {
        return fail(ErrorCode::kCorrupt, "a coded stream has impossible sizes");
    }
    decoder.state_ = *first;
    decoder.next_state_ = *second;
    decoder.words_ = bytes.data() + reader.position();
    decoder.plain_end_ = bytes.data() + bytes.size();
    decoder.plain_ = decoder.plain_end_ - *plain_size;
    decoder.words_end_ = decoder.plain_;
    return decoder;
}

Expected<void> RangeDecoder::finish() const {
    const bool whole = !overrun_ && state_ == kLowest && next_state_ == kLowest && words_ == words_end_ &&
                       plain_ == plain_end_ && plain_count_ < 8 && plain_pending_ == 0;
    if (!whole) return fail(ErrorCode::kCorrupt, "a coded stream does not end where its values do");
    return {};
}

std::uint64_t max_symbol_count(std::uint64_t size_bytes) {
    // log2(4096/4095) is above 1/2840 bits; states are whole numbers, which may round up to 6 % of so little
    // away. The states at the end hold 32 bits beside the words.
    return size_bytes > (std::uint64_t{1} << 48) ? ~std::uint64_t{0} : (8 * size_bytes + 64) * 3024;
}

}  // namespace batchenc
