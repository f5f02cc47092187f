#include "codecs/coded_streams.h"

#include <functional>
#include <numeric>
#include <queue>
#include <utility>

namespace batchenc {

Streams deal_streams(std::span<const std::int64_t> values_of_cluster, std::int64_t values_per_stream) {
    const std::int64_t total =
        std::accumulate(values_of_cluster.begin(), values_of_cluster.end(), std::int64_t{0});
    const auto clusters = static_cast<std::int64_t>(values_of_cluster.size());
    const auto count = static_cast<std::size_t>(
        std::clamp((total + values_per_stream / 2) / values_per_stream, std::int64_t{1}, clusters));
    std::vector<std::int32_t> by_size(values_of_cluster.size());
    std::iota(by_size.begin(), by_size.end(), 0);
    std::stable_sort(by_size.begin(), by_size.end(), [&](std::int32_t a, std::int32_t b) {
        return values_of_cluster[static_cast<std::size_t>(a)] >
               values_of_cluster[static_cast<std::size_t>(b)];
    });
    Streams streams(count);
    using Load = std::pair<std::int64_t, std::size_t>;  // values dealt so far, stream: the least loaded, then
                                                        // the first, on top
    std::priority_queue<Load, std::vector<Load>, std::greater<>> loads;
    for (std::size_t stream = 0; stream < count; ++stream) loads.emplace(0, stream);
    for (const std::int32_t i : by_size) {
        const auto [load, stream] = loads.top();
        loads.pop();
        streams[stream].push_back(i);
        loads.emplace(load + values_of_cluster[static_cast<std::size_t>(i)], stream);
    }
    return streams;
}

Expected<std::vector<std::span<const std::uint8_t>>> split_streams(
    ByteReader& reader, const Streams& streams, std::span<const std::int64_t> values_of_cluster) {
    std::vector<std::uint64_t> sizes;
    for (std::size_t s = 0; s < streams.size(); ++s) {
        const auto size = reader.get_varint(reader.remaining());
        if (!size) return tl::unexpected(size.error());
        sizes.push_back(*size);
    }
    std::vector<std::span<const std::uint8_t>> parts;
    for (std::size_t s = 0; s < streams.size(); ++s) {
        const auto part = reader.get_bytes(sizes[s]);
        if (!part) return tl::unexpected(part.error());
        std::uint64_t values = 0;
        for (const std::int32_t i : streams[s])
            values += static_cast<std::uint64_t>(values_of_cluster[static_cast<std::size_t>(i)]);
        if (values > max_symbol_count(part->size()))
            return fail(ErrorCode::kCorrupt, "more values than the bytes can hold");
        parts.push_back(*part);
    }
    if (reader.remaining() != 0) return fail(ErrorCode::kCorrupt, "bytes left over");
    return parts;
}

}  // namespace batchenc
