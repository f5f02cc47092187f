#pragma once

#include <cstdint>
#include <vector>

#include "core/mesh_sequence.h"

namespace batchenc {

// What makes coders of bytes fit for positions of a clip: levels of a grid, their differences in time as
// small unsigned numbers, and the bytes of a kind together. Levels wrap around modulo 2^32.

/// Levels of all coordinates on a grid through the world's origin: [frame][vertex][xyz]. per_step: 1 / step;
/// every coordinate times it below 2^31 in magnitude.
void quantise(PositionsView positions, double per_step, std::vector<std::int32_t>& levels);
/// The way back.
void dequantise(const std::vector<std::int32_t>& levels, double step, std::vector<float>& positions);

/// Differences of values from those of the `order` frames before, as linear prediction of order 0 … 2 has
/// them (the first frames of a lower order), folded to unsigned: 0, -1, 1, -2, … become 0, 1, 2, 3, …
/// row: values of a frame.
void take_deltas(const std::vector<std::int32_t>& levels, std::size_t row, int order,
                 std::vector<std::uint32_t>& folded);
/// The way back.
void add_deltas(const std::vector<std::uint32_t>& folded, std::size_t row, int order,
                std::vector<std::int32_t>& levels);

/// Lowest bytes of all values first, then the next higher ones, and so on.
void split_bytes(const std::vector<std::uint32_t>& values, std::vector<std::uint8_t>& planes);
/// The way back. planes: a multiple of four.
void join_bytes(const std::vector<std::uint8_t>& planes, std::vector<std::uint32_t>& values);

}  // namespace batchenc
