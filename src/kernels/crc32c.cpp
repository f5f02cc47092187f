#include "kernels/crc32c.h"

#include <array>
#include <bit>
#include <cstddef>
#include <cstring>

#if defined(__x86_64__)
#include <nmmintrin.h>
#endif

namespace batchenc {
namespace {

static_assert(std::endian::native == std::endian::little, "both forms load words in memory order");

constexpr std::uint32_t kPolynomial = 0x82F63B78;  // Castagnoli, bits reversed

using Table = std::array<std::uint32_t, 256>;

// kTables[k][b]: the remainder of byte b followed by k zero bytes.
constexpr std::array<Table, 8> make_tables() {
    std::array<Table, 8> tables{};
    for (std::uint32_t byte = 0; byte < 256; ++byte) {
        std::uint32_t remainder = byte;
        for (int bit = 0; bit < 8; ++bit) remainder = (remainder >> 1) ^ ((remainder & 1) ? kPolynomial : 0);
        tables[0][byte] = remainder;
    }
    for (std::size_t k = 1; k < tables.size(); ++k) {
        for (std::size_t byte = 0; byte < 256; ++byte) {
            const std::uint32_t before = tables[k - 1][byte];
            tables[k][byte] = (before >> 8) ^ tables[0][before & 0xff];
        }
    }
    return tables;
}
constexpr std::array<Table, 8> kTables = make_tables();

// State in, state out: the two public functions put the initial and final inversion around it.
std::uint32_t update_portable(std::uint32_t state, const std::uint8_t* data, std::size_t size) {
    for (; size >= 8; size -= 8, data += 8) {
        std::uint32_t low, high;
        std::memcpy(&low, data, 4);
        std::memcpy(&high, data + 4, 4);
        low ^= state;
        state = kTables[7][low & 0xff] ^ kTables[6][(low >> 8) & 0xff] ^ kTables[5][(low >> 16) & 0xff] ^
                kTables[4][low >> 24] ^ kTables[3][high & 0xff] ^ kTables[2][(high >> 8) & 0xff] ^
                kTables[1][(high >> 16) & 0xff] ^ kTables[0][high >> 24];
    }
    for (; size > 0; --size, ++data) state = (state >> 8) ^ kTables[0][(state ^ *data) & 0xff];
    return state;
}

#if defined(__x86_64__)

// The instruction takes three cycles and a new one can start every cycle, so three stretches of kStretch
// bytes are worked side by side and joined: state(AB) = append_zeros(state(A), |B|) ^ state from zero (B).
constexpr std::size_t kStretch = 2048;

// append_zeros is linear over GF(2): four look-ups by byte, filled from its matrix, which is the square of
// the matrix for half as many zeros.
constexpr std::array<Table, 4> make_append_zeros() {
    std::array<std::uint32_t, 32> matrix{};  // column i: what becomes of bit i
    for (std::size_t i = 0; i < 32; ++i) {
        const std::uint32_t bit = std::uint32_t{1} << i;
        matrix[i] = (bit >> 8) ^ kTables[0][bit & 0xff];
    }
    const auto apply = [&matrix](std::uint32_t vector) {
        std::uint32_t product = 0;
        for (std::size_t i = 0; vector != 0; ++i, vector >>= 1) {
            if (vector & 1) product ^= matrix[i];
        }
        return product;
    };
    static_assert(std::has_single_bit(kStretch));
    for (std::size_t zeros = 1; zeros < kStretch; zeros *= 2) {
        std::array<std::uint32_t, 32> square{};
        for (std::size_t i = 0; i < 32; ++i) square[i] = apply(matrix[i]);
        matrix = square;
    }
    std::array<Table, 4> tables{};
    for (std::size_t place = 0; place < 4; ++place) {
        for (std::uint32_t byte = 0; byte < 256; ++byte) tables[place][byte] = apply(byte << (8 * place));
    }
    return tables;
}
constexpr std::array<Table, 4> kAppendZeros = make_append_zeros();

std::uint64_t append_zeros(std::uint64_t state) {
    return kAppendZeros[0][state & 0xff] ^ kAppendZeros[1][(state >> 8) & 0xff] ^
           kAppendZeros[2][(state >> 16) & 0xff] ^ kAppendZeros[3][(state >> 24) & 0xff];
}

std::uint64_t load_word(const std::uint8_t* data) {
    std::uint64_t word;
    std::memcpy(&word, data, sizeof(word));
    return word;
}

[[gnu::target("sse4.2")]] std::uint32_t update_sse42(std::uint32_t initial, const std::uint8_t* data,
                                                     std::size_t size) {
    std::uint64_t state = initial;
    for (; size >= 3 * kStretch; size -= 3 * kStretch, data += 3 * kStretch) {
        std::uint64_t second = 0, third = 0;
        for (std::size_t i = 0; i < kStretch; i += 8) {
            state = _mm_crc32_u64(state, load_word(data + i));
            second = _mm_crc32_u64(second, load_word(data + kStretch + i));
            third = _mm_crc32_u64(third, load_word(data + 2 * kStretch + i));
        }
        state = append_zeros(append_zeros(state) ^ second) ^ third;
    }
    for (; size >= 8; size -= 8, data += 8) state = _mm_crc32_u64(state, load_word(data));
    auto rest = static_cast<std::uint32_t>(state);
    for (; size > 0; --size, ++data) rest = _mm_crc32_u8(rest, *data);
    return rest;
}

#endif

}  // namespace

std::uint32_t crc32c(std::span<const std::uint8_t> bytes, std::uint32_t seed) {
#if defined(__x86_64__)
    if (__builtin_cpu_supports("sse4.2")) return ~update_sse42(~seed, bytes.data(), bytes.size());
#endif
    return crc32c_portable(bytes, seed);
}

std::uint32_t crc32c_portable(std::span<const std::uint8_t> bytes, std::uint32_t seed) {
    return ~update_portable(~seed, bytes.data(), bytes.size());
}

}  // namespace batchenc
