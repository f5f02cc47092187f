#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "codecs/baselines/baseline_header.h"
#include "codecs/clip_bitstream.h"
#include "codecs/clip_codec.h"

namespace batchenc {

// Wavelets along time by lifting (F. Payan and M. Antonini, "Temporal wavelet-based compression for 3D
// animated models", 2007; 2.4.2.4). docs/BASELINES.md says what is coded.

/// The (4,2) wavelet transform of signals in lanes: details are what a cubic through four even samples misses
/// of the odd ones, and a quarter of the details beside it is added to each even sample (A. R. Calderbank, I.
/// Daubechies, W. Sweldens and B.-L. Yeo, "Wavelet transforms that map integers to integers", 1998), again on
/// the even samples until kLowest or fewer are left. Signals are continued symmetrically about their first
/// and last samples, so that any length has as many coefficients. In float32 by + - * in a fixed order.
class LiftedWavelet {
 public:
    static constexpr std::int64_t kLowest = 8;

    /// length: at least 1.
    explicit LiftedWavelet(std::int64_t length);

    std::int64_t length() const { return length_; }
    int level_count() const { return levels_; }
    std::int64_t low_count() const { return low_count_; }
    /// Rows in which the coefficients are coded: those of the low band, then details, the coarsest first.
    const std::vector<std::int64_t>& row_order() const { return row_order_; }
    /// Band of each entry of row_order: 0 the low band, then 1 … level_count, from coarse to fine.
    int band(std::int64_t entry) const;
    /// Root of the sum of squares of what one unit in the middle of each band adds to a signal.
    const std::vector<double>& gains() const { return gains_; }

    /// In place. values: length rows of kDctLanes floats, a signal a lane.
    void forward(float* values) const;
    void inverse(float* values) const;

 private:
    std::int64_t length_;
    int levels_ = 0;
    std::int64_t low_count_;
    std::vector<std::int64_t> row_order_;
    std::vector<double> gains_;
};

/// See encode_clip. header: of this clip. Error: kLimit.
Expected<EncodedClip> encode_wavelets(PositionsView positions, const MeshTopology& mesh,
                                      const BaselineHeader& header, const Executor& executor);

/// See decode_clip.
Expected<std::unique_ptr<DecodedClip>> decode_wavelets(const ClipBitstream& clip, const SharedMesh& mesh,
                                                       std::int64_t size_limit_bytes,
                                                       const Executor& executor);

}  // namespace batchenc
