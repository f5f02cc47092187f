#include "codecs/baselines/level_grid.h"

#include "codecs/level_rows.h"
#include "kernels/range_coder.h"

namespace batchenc {

std::vector<std::uint8_t> encode_level_grid(std::span<const std::int32_t> levels, std::int64_t columns) {
    const auto width = static_cast<std::size_t>(3 * columns);
    RangeEncoder encoder;
    RowContexts contexts;
    RowMemory memory(columns, 1);
    for (; !levels.empty(); levels = levels.subspan(width))
        encode_row(encoder, contexts, memory, 0, levels.first(width));
    return encoder.finish();
}

Expected<std::vector<std::int32_t>> decode_level_grid(std::span<const std::uint8_t> bytes, std::int64_t rows,
                                                      std::int64_t columns) {
    // A row has one symbol at least, its tail; a row of zeros no more.
    const auto width = static_cast<std::size_t>(3 * columns);
    if (static_cast<std::uint64_t>(rows) > max_symbol_count(bytes.size()))
        return fail(ErrorCode::kCorrupt, "more rows than the bytes can hold");
    std::vector<std::int32_t> levels(static_cast<std::size_t>(rows) * width);
    auto decoder = RangeDecoder::open(bytes);
    if (!decoder) return tl::unexpected(decoder.error());
    RowContexts contexts;
    RowMemory memory(columns, 1);
    for (std::span<std::int32_t> rest(levels); !rest.empty(); rest = rest.subspan(width))
        if (!decode_row(*decoder, contexts, memory, 0, rest.first(width)))
            return fail(ErrorCode::kCorrupt, "a row of levels does not decode");
    if (auto whole = decoder->finish(); !whole) return tl::unexpected(whole.error());
    return levels;
}

}  // namespace batchenc
