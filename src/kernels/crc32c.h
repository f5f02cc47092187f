#pragma once

#include <cstdint>
#include <span>

namespace batchenc {

/// CRC-32C (Castagnoli, RFC 3720 appendix B.4) of bytes; crc32c("123456789") is 0xE3069283. Pass the result
/// of the bytes before as `seed` to go on. Uses the SSE4.2 instruction where the CPU has it, tables
/// elsewhere; same result.
std::uint32_t crc32c(std::span<const std::uint8_t> bytes, std::uint32_t seed = 0);

/// The table-driven form alone, so that tests and benchmarks can hold it against the other.
std::uint32_t crc32c_portable(std::span<const std::uint8_t> bytes, std::uint32_t seed = 0);

}  // namespace batchenc
