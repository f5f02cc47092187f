#include "bench/peers/quantised_deltas.h"

#include <algorithm>

namespace batchenc {

namespace {

/// What the frames before predict, modulo 2^32. at: of the value in the levels, which are decoded so far.
std::uint32_t predict(const std::int32_t* levels, std::size_t at, std::size_t row, int order) {
    const auto before = [&](std::size_t frames) {
        return static_cast<std::uint32_t>(levels[at - frames * row]);
    };
    const int most = at < row ? 0 : at < 2 * row ? 1 : 2;
    switch (std::min(order, most)) {
        case 0:
            return 0;
        case 1:
            return before(1);
        default:
            return 2 * before(1) - before(2);
    }
}

}  // namespace

void quantise(PositionsView positions, double per_step, std::vector<std::int32_t>& levels) {
    const auto count = static_cast<std::size_t>(positions.value_count());
    levels.resize(count);
    for (std::size_t k = 0; k < count; ++k) {
        const double value = static_cast<double>(positions.data()[k]) * per_step;
        levels[k] = static_cast<std::int32_t>(value + (value < 0.0 ? -0.5 : 0.5));
    }
}

void dequantise(const std::vector<std::int32_t>& levels, double step, std::vector<float>& positions) {
    positions.resize(levels.size());
    for (std::size_t k = 0; k < levels.size(); ++k)
        positions[k] = static_cast<float>(step * static_cast<double>(levels[k]));
}

void take_deltas(const std::vector<std::int32_t>& levels, std::size_t row, int order,
                 std::vector<std::uint32_t>& folded) {
    folded.resize(levels.size());
    for (std::size_t k = 0; k < levels.size(); ++k) {
        const auto change = static_cast<std::int32_t>(static_cast<std::uint32_t>(levels[k]) -
                                                      predict(levels.data(), k, row, order));
        folded[k] = (static_cast<std::uint32_t>(change) << 1) ^ static_cast<std::uint32_t>(change >> 31);
    }
}

void add_deltas(const std::vector<std::uint32_t>& folded, std::size_t row, int order,
                std::vector<std::int32_t>& levels) {
    levels.resize(folded.size());
    for (std::size_t k = 0; k < folded.size(); ++k) {
        const std::uint32_t change = (folded[k] >> 1) ^ (0u - (folded[k] & 1u));
        levels[k] = static_cast<std::int32_t>(change + predict(levels.data(), k, row, order));
    }
}

void split_bytes(const std::vector<std::uint32_t>& values, std::vector<std::uint8_t>& planes) {
    const std::size_t count = values.size();
    planes.resize(4 * count);
    for (std::size_t b = 0; b < 4; ++b) {
        for (std::size_t k = 0; k < count; ++k)
            planes[b * count + k] = static_cast<std::uint8_t>(values[k] >> 8 * b);
    }
}

void join_bytes(const std::vector<std::uint8_t>& planes, std::vector<std::uint32_t>& values) {
    const std::size_t count = planes.size() / 4;
    values.assign(count, 0);
    for (std::size_t b = 0; b < 4; ++b) {
        for (std::size_t k = 0; k < count; ++k)
            values[k] |= static_cast<std::uint32_t>(planes[b * count + k]) << 8 * b;
    }
}

}  // namespace batchenc
