#include "io/hdf5/chunk_unpacker.h"

#include <libdeflate.h>

#include <cstring>
#include <new>

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

namespace batchenc {

namespace {

template <typename Word>
void gather_bytes(const std::uint8_t* plane, std::int64_t stride, std::int64_t count, std::uint8_t* values) {
    for (std::int64_t i = 0; i < count; ++i) {
        Word word = 0;
        for (std::size_t b = 0; b < sizeof(Word); ++b)
            word |= static_cast<Word>(plane[static_cast<std::int64_t>(b) * stride + i]) << (8 * b);
        std::memcpy(values + i * static_cast<std::int64_t>(sizeof(Word)), &word, sizeof(Word));
    }
}

#if defined(__SSE2__)
/// Sixteen float32 at a time; SSE2 is part of every x86-64. Returns how many were done.
std::int64_t gather_float32_blocks(const std::uint8_t* plane, std::int64_t stride, std::int64_t count,
                                   std::uint8_t* values) {
    std::int64_t i = 0;
    for (; i + 16 <= count; i += 16) {
        const auto load = [&](std::int64_t b) {
            __m128i bytes;
            std::memcpy(&bytes, plane + b * stride + i, sizeof(bytes));
            return bytes;
        };
        const __m128i b0 = load(0), b1 = load(1), b2 = load(2), b3 = load(3);
        const __m128i low01 = _mm_unpacklo_epi8(b0, b1), high01 = _mm_unpackhi_epi8(b0, b1);
        const __m128i low23 = _mm_unpacklo_epi8(b2, b3), high23 = _mm_unpackhi_epi8(b2, b3);
        const __m128i words[4] = {_mm_unpacklo_epi16(low01, low23), _mm_unpackhi_epi16(low01, low23),
                                  _mm_unpacklo_epi16(high01, high23), _mm_unpackhi_epi16(high01, high23)};
        std::memcpy(values + i * 4, words, sizeof(words));
    }
    return i;
}
#endif

}  // namespace

Inflater::Inflater() : decompressor_(libdeflate_alloc_decompressor()) {
    if (!decompressor_) throw std::bad_alloc();
}

Inflater::~Inflater() = default;

void Inflater::Release::operator()(libdeflate_decompressor* decompressor) const {
    libdeflate_free_decompressor(decompressor);
}

bool Inflater::inflate(std::span<const std::uint8_t> packed, std::span<std::uint8_t> unpacked) {
    // Without a place for the actual size, libdeflate accepts nothing but the exact one.
    return libdeflate_zlib_decompress(decompressor_.get(), packed.data(), packed.size(), unpacked.data(),
                                      unpacked.size(), nullptr) == LIBDEFLATE_SUCCESS;
}

void unshuffle(const std::uint8_t* shuffled, std::int64_t total_count, std::size_t value_bytes,
               std::int64_t first, std::int64_t count, std::uint8_t* values) {
    const std::uint8_t* plane = shuffled + first;
    if (value_bytes == 8) return gather_bytes<std::uint64_t>(plane, total_count, count, values);
    std::int64_t done = 0;
#if defined(__SSE2__)
    done = gather_float32_blocks(plane, total_count, count, values);
#endif
    gather_bytes<std::uint32_t>(plane + done, total_count, count - done, values + done * 4);
}

}  // namespace batchenc
