#include "codecs/baselines/mesh_levels.h"

#include <algorithm>
#include <cmath>

#include "codecs/baselines/level_grid.h"
#include "kernels/byte_stream.h"
#include "kernels/temporal_series.h"

namespace batchenc {
namespace {

/// Prediction of a level from those before it: what the enumeration says, the mean of an edge that has no
/// triangle, or what stands at the anchor.
std::int32_t predicted(const MeshTraversal& traversal, LevelPrediction prediction, const std::int32_t* row,
                       std::size_t place, std::size_t axis) {
    const auto level = [&](std::int32_t at) {
        return static_cast<std::uint32_t>(row[3 * static_cast<std::size_t>(at) + axis]);
    };
    const auto gates = traversal.gates_of(place);
    if (gates.empty()) {
        const std::int32_t anchor = traversal.anchor[place];
        return anchor < 0 ? 0 : static_cast<std::int32_t>(level(anchor));
    }
    if (prediction == LevelPrediction::kMean) {
        std::uint32_t sum = 0;
        for (const Gate& gate : gates) sum += level(gate.left) + level(gate.right);
        return static_cast<std::int32_t>(sum) / (2 * static_cast<std::int32_t>(gates.size()));
    }
    const Gate& gate = gates.front();
    const std::uint32_t sum = level(gate.left) + level(gate.right);
    return gate.opposite < 0 ? static_cast<std::int32_t>(sum) / 2
                             : static_cast<std::int32_t>(sum - level(gate.opposite));
}

/// About what a level costs, in bits.
double cost(std::int32_t level) { return std::log2(1.0 + 2.0 * std::abs(static_cast<double>(level))); }

/// Rows from the first on whose residuals are thought to be cheaper than the levels, one after another.
std::size_t rows_to_predict(const MeshTraversal& traversal, LevelPrediction prediction,
                            std::span<const std::int32_t> levels) {
    const std::size_t width = 3 * traversal.order.size();
    double saved = 0.0, most_saved = 0.0;
    std::size_t best = 0;
    std::vector<std::int32_t> row(width);
    for (std::size_t r = 0; r < levels.size() / width; ++r) {
        std::copy_n(levels.data() + r * width, width, row.data());
        for (const std::int32_t level : row) saved += cost(level);
        take_predictions(traversal, prediction, row);
        for (const std::int32_t level : row) saved -= cost(level);
        if (saved <= most_saved) continue;
        most_saved = saved;
        best = r + 1;
    }
    return best;
}

}  // namespace

void take_predictions(const MeshTraversal& traversal, LevelPrediction prediction,
                      std::span<std::int32_t> levels) {
    const std::size_t width = 3 * traversal.order.size();
    for (std::int32_t* row = levels.data(); row != levels.data() + levels.size(); row += width)
        for (std::size_t k = width; k-- > 0;)  // backwards: what a level is predicted from is before it
            row[k] = static_cast<std::int32_t>(
                static_cast<std::uint32_t>(row[k]) -
                static_cast<std::uint32_t>(predicted(traversal, prediction, row, k / 3, k % 3)));
}

void add_predictions(const MeshTraversal& traversal, LevelPrediction prediction,
                     std::span<std::int32_t> levels) {
    const std::size_t width = 3 * traversal.order.size();
    for (std::int32_t* row = levels.data(); row != levels.data() + levels.size(); row += width)
        for (std::size_t k = 0; k < width; ++k)
            row[k] = wrapping_sum(row[k], predicted(traversal, prediction, row, k / 3, k % 3));
}

std::vector<std::uint8_t> write_predicted_grid(const MeshTraversal& traversal, LevelPrediction prediction,
                                               std::span<std::int32_t> levels) {
    const std::size_t width = 3 * traversal.order.size();
    const std::size_t predicted = rows_to_predict(traversal, prediction, levels);
    take_predictions(traversal, prediction, levels.first(predicted * width));
    ByteWriter out;
    out.put_varint(predicted);
    out.put_bytes(encode_level_grid(levels, static_cast<std::int64_t>(traversal.order.size())));
    return out.take();
}

Expected<std::vector<std::int32_t>> read_predicted_grid(std::span<const std::uint8_t> bytes,
                                                        const MeshTraversal& traversal,
                                                        LevelPrediction prediction, std::int64_t rows) {
    const std::size_t vertices = traversal.order.size();
    ByteReader reader(bytes);
    const auto predicted = reader.get_varint(static_cast<std::uint64_t>(rows));
    if (!predicted) return tl::unexpected(predicted.error());
    auto levels =
        decode_level_grid(bytes.subspan(reader.position()), rows, static_cast<std::int64_t>(vertices));
    if (levels) add_predictions(traversal, prediction, std::span(*levels).first(*predicted * 3 * vertices));
    return levels;
}

}  // namespace batchenc
