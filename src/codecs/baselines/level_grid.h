#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/error.h"

namespace batchenc {

// What baselines have coded: rows of integers, three a column, each in a context by the sizes of those around
// it, in its row and in the row before (codecs/level_rows.h).

/// Codes rows of 3 × columns levels each. levels: rows × columns × 3.
std::vector<std::uint8_t> encode_level_grid(std::span<const std::int32_t> levels, std::int64_t columns);

/// The way back: rows × columns × 3 levels. Nothing is allocated that the bytes cannot hold.
/// Error: kCorrupt.
Expected<std::vector<std::int32_t>> decode_level_grid(std::span<const std::uint8_t> bytes, std::int64_t rows,
                                                      std::int64_t columns);

}  // namespace batchenc
