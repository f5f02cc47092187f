#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "core/error.h"
#include "core/executor.h"
#include "kernels/byte_stream.h"
#include "kernels/range_coder.h"

namespace batchenc {

// Clusters that share coded streams: each stream is coded on its own, all of them at once.

/// The clusters of each stream.
using Streams = std::vector<std::vector<std::int32_t>>;

/// Deals clusters to coded streams: about one stream for every `values_per_stream` values, so that streams
/// can be coded at once and each is long enough to learn from; large clusters first, each to the stream that
/// has least. Depends on the sizes alone.
Streams deal_streams(std::span<const std::int64_t> values_of_cluster, std::int64_t values_per_stream = 65536);

/// Runs `code_stream` for each stream at once and joins what comes out: sizes, then bytes.
template <typename CodeStream>
void append_streams(ByteWriter& out, const Streams& streams, const Executor& executor,
                    CodeStream code_stream) {
    std::vector<std::vector<std::uint8_t>> bytes(streams.size());
    executor.for_each(static_cast<std::int64_t>(streams.size()), [&](std::int64_t s) {
        bytes[static_cast<std::size_t>(s)] = code_stream(streams[static_cast<std::size_t>(s)]);
    });
    for (const auto& stream : bytes) out.put_varint(stream.size());
    for (const auto& stream : bytes) out.put_bytes(stream);
}

/// Sizes, then bytes, of all streams; checked against the section, and their values against what the bytes
/// can hold. Error: kCorrupt.
Expected<std::vector<std::span<const std::uint8_t>>> split_streams(
    ByteReader& reader, const Streams& streams, std::span<const std::int64_t> values_of_cluster);

/// Decodes all streams at once. decode_stream(decoder, clusters) returns false on corruption; `whole` says
/// whether it decodes each stream to its end, which is then checked.
template <typename DecodeStream>
Expected<void> decode_streams(const std::vector<std::span<const std::uint8_t>>& parts, const Streams& streams,
                              bool whole, const Executor& executor, DecodeStream decode_stream) {
    std::vector<std::uint8_t> good(parts.size(), 0);
    executor.for_each(static_cast<std::int64_t>(parts.size()), [&](std::int64_t index) {
        const auto s = static_cast<std::size_t>(index);
        auto decoder = RangeDecoder::open(parts[s]);
        good[s] = decoder && decode_stream(*decoder, streams[s]) && (!whole || decoder->finish());
    });
    if (std::find(good.begin(), good.end(), 0) != good.end())
        return fail(ErrorCode::kCorrupt, "a coded stream does not decode");
    return {};
}

}  // namespace batchenc
