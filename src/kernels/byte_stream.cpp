#include "kernels/byte_stream.h"

namespace batchenc {

Expected<std::uint64_t> ByteReader::get_varint(std::uint64_t limit) {
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < 10; ++i) {
        if (at_ + i >= bytes_.size()) return fail(ErrorCode::kCorrupt, "the stream ends inside a number");
        const std::uint64_t byte = bytes_[at_ + i];
        if (i == 9 && byte > 1) break;  // bits beyond the 64th
        value |= (byte & 0x7f) << (7 * i);
        if (byte & 0x80) continue;
        if (byte == 0 && i > 0) return fail(ErrorCode::kCorrupt, "a number is padded");
        if (value > limit) {
            return fail(ErrorCode::kCorrupt, "a number is " + std::to_string(value) + ", above its limit " +
                                                 std::to_string(limit));
        }
        at_ += i + 1;
        return value;
    }
    return fail(ErrorCode::kCorrupt, "a number is longer than 64 bits");
}

Expected<std::span<const std::uint8_t>> ByteReader::get_bytes(std::uint64_t count) {
    if (remaining() < count) return fail(ErrorCode::kCorrupt, "the stream ends too early");
    const auto bytes = bytes_.subspan(at_, static_cast<std::size_t>(count));
    at_ += static_cast<std::size_t>(count);
    return bytes;
}

}  // namespace batchenc
