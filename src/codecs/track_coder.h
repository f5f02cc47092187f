#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/executor.h"
#include "kernels/bit_coder.h"
#include "kernels/dct.h"
#include "kernels/mixed_integers.h"

namespace batchenc {

// Tracks: three values that belong together over the frames of a clip, such as a basis vector of trajectories
// or a rotation. Each is coded in the form that suits its motion: transformed along time in blocks of one
// length, or value by value.

/// Along what a track is coded. The numbers stand in bitstreams.
enum class TrackForm : std::uint8_t {
    kSteps = 0,    ///< values, each against the one before
    kSlopes = 1,   ///< values, each against the line through the two before
    kBlocks8 = 2,  ///< transformed in blocks of about 8 frames
    kBlocks16 = 3,
    kBlocks32 = 4,
    kBlocks64 = 5,
    kBlocks128 = 6,
    kBlocks256 = 7,
};
inline constexpr std::size_t kTrackForms = 8;

/// The blocks of a clip's frames in one form: of lengths that differ by one at most.
struct TrackBlocks {
    std::int64_t frames = 0, count = 0;

    TrackBlocks(std::int64_t frame_count, TrackForm form);
    std::int64_t begin(std::int64_t block) const { return block * frames / count; }
};

/// Three axes of F levels each: values on a lattice, or their transforms block by block.
struct TrackLevels {
    TrackForm form = TrackForm::kSteps;
    std::vector<std::int32_t> values;  ///< 3 × F, an axis after the other
    float cost = 0.0f;  ///< of encoders: squared error in steps, and what the bits are thought to be worth
};

/// Predicts the means of blocks, each by where the block before it ends. By IEEE operations in a fixed order:
/// the same on every machine.
class MeanPrediction {
 public:
    /// levels: of one axis, of the block before. lengths: of both. Returns the level at frequency 0.
    std::int32_t operator()(const std::int32_t* levels, std::int64_t length_before, std::int64_t length);

 private:
    /// What each frequency of a block of n frames is at its end: the root of two times cos(pi j (2n - 1) /
    /// 2n), which is (-1)^j cos(pi j / 2n).
    const std::vector<double>& weights_of(std::int64_t length);

    std::vector<std::vector<double>> weights_;  // a length each
};

/// The contexts of one stream of tracks.
class TrackCoder {
 public:
    explicit TrackCoder(std::int64_t frame_count);

    /// Codes a track in either direction. rank: how many of its kind came before it. When decoding,
    /// track.values has its size and is overwritten; a corrupt stream gives some values.
    void code(BitCoder& coder, TrackLevels& track, std::size_t rank);

 private:
    void code_values(BitCoder& coder, TrackLevels& track, std::size_t rank);
    void code_blocks(BitCoder& coder, TrackLevels& track, std::size_t rank);

    std::int64_t frame_count_;
    AdaptiveNumber forms_{kTrackForms - 1};
    MixedIntegers transformed_, first_, stepped_;
    MeanPrediction predict_mean_;
};

/// Turns tracks into levels and back: the transforms of every form for one number of frames. All of it gives
/// the same bits on every machine.
class TrackTransform {
 public:
    explicit TrackTransform(std::int64_t frame_count);

    /// Quantises tracks to steps of 1, each in the form in which squared error and bits are least together.
    /// tracks: G tracks of 3F floats, [frame][axis], in steps, magnitudes at most 2^27. The executor gets
    /// work for each few of them.
    std::vector<TrackLevels> quantize(std::span<const std::vector<float>> tracks,
                                      const Executor& executor) const;
    /// The way back. Returns 3F floats, [frame][axis], for each track.
    std::vector<std::vector<float>> dequantize(std::span<const TrackLevels> tracks,
                                               const Executor& executor) const;

 private:
    struct Lanes;
    const Dct& dct_of(std::int64_t length) const;

    std::int64_t frame_count_;
    std::vector<std::unique_ptr<Dct>> dcts_;  // ascending lengths
};

}  // namespace batchenc
