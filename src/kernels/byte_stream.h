#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/error.h"

namespace batchenc {

/// Appends little-endian values to a byte buffer.
class ByteWriter {
 public:
    template <typename T>
    void put(T value) {
        static_assert(std::is_arithmetic_v<T> && std::endian::native == std::endian::little);
        const std::size_t at = bytes_.size();
        bytes_.resize(at + sizeof(T));
        std::memcpy(bytes_.data() + at, &value, sizeof(T));
    }
    /// Unsigned LEB128: seven bits a byte, low ones first; 1 to 10 bytes.
    void put_varint(std::uint64_t value) {
        for (; value >= 0x80; value >>= 7) bytes_.push_back(static_cast<std::uint8_t>(value | 0x80));
        bytes_.push_back(static_cast<std::uint8_t>(value));
    }
    void put_bytes(std::span<const std::uint8_t> bytes) {
        bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
    }

    const std::vector<std::uint8_t>& bytes() const { return bytes_; }
    std::vector<std::uint8_t> take() { return std::move(bytes_); }
    std::size_t size() const { return bytes_.size(); }

 private:
    std::vector<std::uint8_t> bytes_;
};

/// Reads what ByteWriter wrote from bytes that nobody vouches for: every call checks what is left.
class ByteReader {
 public:
    explicit ByteReader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

    /// Next value. Error kCorrupt when fewer bytes are left; the reader then stays where it was.
    template <typename T>
    Expected<T> get() {
        static_assert(std::is_arithmetic_v<T> && std::endian::native == std::endian::little);
        if (remaining() < sizeof(T)) return fail(ErrorCode::kCorrupt, "the stream ends too early");
        T value;
        std::memcpy(&value, bytes_.data() + at_, sizeof(T));
        at_ += sizeof(T);
        return value;
    }
    /// The next N values. Error as of get.
    template <typename T, std::size_t N>
    Expected<std::array<T, N>> get_array() {
        std::array<T, N> values;
        for (T& value : values) {
            const auto read = get<T>();
            if (!read) return tl::unexpected(read.error());
            value = *read;
        }
        return values;
    }
    /// Next LEB128 value. Error kCorrupt at the end of the bytes, for a value above `limit`, and for a padded
    /// form, so that every value has one spelling.
    Expected<std::uint64_t> get_varint(std::uint64_t limit);
    /// The next `count` bytes, not copied. Error kCorrupt when fewer are left.
    Expected<std::span<const std::uint8_t>> get_bytes(std::uint64_t count);

    std::size_t remaining() const { return bytes_.size() - at_; }
    std::size_t position() const { return at_; }

 private:
    std::span<const std::uint8_t> bytes_;
    std::size_t at_ = 0;
};

}  // namespace batchenc
