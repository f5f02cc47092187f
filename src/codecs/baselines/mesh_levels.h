#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/error.h"
#include "kernels/mesh_traversal.h"

namespace batchenc {

// Levels in the traversal's order, three a vertex, against what those before them say. Sums wrap around,
// which only a corrupt stream makes them do.

/// How a level is predicted.
enum class LevelPrediction {
    kParallelogram,  ///< at the first gate (C. Touma and C. Gotsman, "Triangle mesh compression", 1998)
    kMean,           ///< of the ends of all gates
};

/// Replaces each row of levels by its residuals. levels: whole rows of the mesh.
void take_predictions(const MeshTraversal& traversal, LevelPrediction prediction,
                      std::span<std::int32_t> levels);
/// The way back.
void add_predictions(const MeshTraversal& traversal, LevelPrediction prediction,
                     std::span<std::int32_t> levels);

/// A level grid of which as many rows, from the first on, are residuals as is thought to be cheapest: their
/// number (varint), then the grid. levels: whole rows of the mesh; overwritten.
std::vector<std::uint8_t> write_predicted_grid(const MeshTraversal& traversal, LevelPrediction prediction,
                                               std::span<std::int32_t> levels);
/// The way back: rows × V × 3 levels. Error: kCorrupt.
Expected<std::vector<std::int32_t>> read_predicted_grid(std::span<const std::uint8_t> bytes,
                                                        const MeshTraversal& traversal,
                                                        LevelPrediction prediction, std::int64_t rows);

}  // namespace batchenc
