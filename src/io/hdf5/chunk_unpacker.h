#pragma once

#include <cstdint>
#include <memory>
#include <span>

struct libdeflate_decompressor;

namespace batchenc {

/// Unpacks zlib streams (RFC 1950) of a known size. One object may be used by one thread at a time.
class Inflater {
 public:
    Inflater();
    ~Inflater();
    Inflater(const Inflater&) = delete;
    Inflater& operator=(const Inflater&) = delete;

    /// Whether `packed` is a whole stream, with a right checksum, of exactly unpacked.size() bytes. The
    /// content of `unpacked` is undefined otherwise. Safe for any input.
    bool inflate(std::span<const std::uint8_t> packed, std::span<std::uint8_t> unpacked);

 private:
    struct Release {
        void operator()(libdeflate_decompressor* decompressor) const;
    };
    std::unique_ptr<libdeflate_decompressor, Release> decompressor_;
};

/// Reverses HDF5's shuffle filter for values [first, first + count) of a chunk.
/// shuffled: value_bytes planes of total_count bytes each, plane b holding byte b of every value.
/// values: count × value_bytes bytes, little-endian. value_bytes is 4 or 8.
void unshuffle(const std::uint8_t* shuffled, std::int64_t total_count, std::size_t value_bytes,
               std::int64_t first, std::int64_t count, std::uint8_t* values);

}  // namespace batchenc
