#include "bench/peers/grid_peer.h"

#include <cmath>
#include <cstdio>

#include "bench/peers/quantised_deltas.h"
#include "kernels/bounding_box.h"

namespace batchenc {

namespace {

constexpr double kMostLevels = 1 << 30;

double largest_magnitude(const MeshSequence& clip) {
    double largest = 0.0;
    for (const float x : clip.positions) largest = std::max(largest, std::abs(static_cast<double>(x)));
    return largest;
}

/// The order of prediction in time, 1 or 2, whose differences are the smaller ones.
int choose_order(const std::vector<std::int32_t>& levels, std::size_t row) {
    double bits[2];
    std::vector<std::uint32_t> folded;
    for (const int order : {1, 2}) {
        take_deltas(levels, row, order, folded);
        double sum = 0.0;
        for (std::size_t k = 0; k < folded.size(); k += 7)  // a sample is enough for a choice
            sum += std::log2(1.0 + static_cast<double>(folded[k]));
        bits[order - 1] = sum;
    }
    return bits[1] < bits[0] ? 2 : 1;
}

}  // namespace

Peer::Range GridPeer::range(const MeshSequence& clip) const {
    const double diagonal = bounding_box(clip.view()).diagonal();
    return {std::max(1e-8 * diagonal, largest_magnitude(clip) / kMostLevels), 0.1 * diagonal};
}

Expected<void> GridPeer::approximate(const MeshSequence& clip, double step, std::vector<float>& decoded) {
    quantise(clip.view(), 1.0 / step, levels_);
    dequantise(levels_, step, decoded);
    return {};
}

Expected<void> GridPeer::encode(const MeshSequence& clip, double step) {
    step_ = step;
    quantise(clip.view(), 1.0 / step, levels_);
    row_ = static_cast<std::size_t>(3 * clip.vertex_count);
    order_ = choose_order(levels_, row_);
    take_deltas(levels_, row_, order_, deltas_);
    return encode_deltas(deltas_, row_);
}

Expected<void> GridPeer::decode(std::vector<float>& positions) {
    if (auto done = decode_deltas(deltas_); !done) return done;
    add_deltas(deltas_, row_, order_, levels_);
    dequantise(levels_, step_, positions);
    return {};
}

std::string GridPeer::setting_text(double step) const {
    char text[64];
    std::snprintf(text, sizeof text, "step %.4g, order %d", step, order_);
    return text;
}

}  // namespace batchenc
