#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "codecs/clip_codec.h"
#include "codecs/coded_segmentation.h"
#include "codecs/seed_triangle_path.h"
#include "core/error.h"
#include "core/mesh_sequence.h"
#include "kernels/cluster_traversal.h"
#include "kernels/dct.h"
#include "kernels/local_frame.h"

namespace batchenc {

// What encoder and decoder of PDCT derive alike.

/// The content of the parameters section.
struct PdctHeader {
    std::int32_t bits = 0;
    std::int32_t intra_bits = 0;
    std::int32_t block = 1;          ///< frames transformed together along time; 1: each for itself
    std::int32_t cluster_count = 0;  ///< N
    FrameLattice lattice;

    /// Of the levels, world units: e_max / 2^bits, and that of the first frame of points.
    float step() const { return step_of(bits); }
    float intra_step() const { return step_of(intra_bits); }

    std::vector<std::uint8_t> write() const;
    /// Error: kCorrupt.
    static Expected<PdctHeader> read(std::span<const std::uint8_t> payload, std::int64_t vertex_count);

 private:
    float step_of(std::int32_t digits) const {
        return lattice.e_max / static_cast<float>(std::int64_t{1} << digits);
    }
};

/// Values of coded streams of levels (see deal_streams): longer than RLPCA's, as most levels are zero.
inline constexpr std::int64_t kLevelsPerStream = std::int64_t{1} << 20;

/// The transforms of one cluster: rows of 3n values, a row a frame, `stride` apart.
class ClusterTransform {
 public:
    /// columns: n, at least 1. block: frames transformed together along time.
    ClusterTransform(std::int64_t columns, std::int64_t block);

    std::int64_t columns() const { return columns_; }
    std::int64_t block() const { return block_; }
    /// Floats from row to row: 3n rounded up to lanes.
    std::int64_t stride() const { return stride_; }

    /// Floats of workspace for any of the calls below.
    std::int64_t workspace_size() const;

    /// Along the columns of every row, each coordinate apart; in place.
    void forward_space(float* rows, std::int64_t count, float* workspace) const;
    void inverse_space(float* rows, std::int64_t count, float* workspace) const;
    /// Along time within one block of `count` rows, at most block(); in place.
    void forward_time(float* rows, std::int64_t count, float* workspace) const;
    void inverse_time(float* rows, std::int64_t count, float* workspace) const;

 private:
    void space(float* rows, std::int64_t count, float* workspace, bool inverse) const;
    void time(float* rows, std::int64_t count, float* workspace, bool inverse) const;

    std::int64_t columns_, block_, stride_;
    Dct along_space_;
    Dct along_time_;  // of whole blocks
};

/// A clip's first frame as a static clip of its own; `auto` is the weighted predictor there, as trying all of
/// them would take longer than the frames after it.
Expected<EncodedClip> encode_intra(PositionsView frame, const MeshTopology& mesh,
                                   const CodecParameters& parameters, const Executor& executor);

/// What the first row of a block is predicted to be from that of the block before: its level, as the lengths
/// of the blocks have it. Rounds by IEEE operations alone.
inline std::int32_t predict_block(std::int32_t before, std::int64_t length_before, std::int64_t length) {
    if (length == length_before) return before;
    const double scale = std::sqrt(static_cast<double>(length) / static_cast<double>(length_before));
    return static_cast<std::int32_t>(std::floor(static_cast<double>(before) * scale + 0.5));
}

/// Order of a cluster of points, once the local coordinates of their first frame are decoded; puts these, 3n
/// values, into that order too.
ClusterTraversal order_points(std::span<const std::int32_t> members, std::span<float> local);

}  // namespace batchenc
