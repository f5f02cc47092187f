#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "bench/peers/peer.h"

namespace batchenc {

/// A coder without loss of levels of a grid over all coordinates, as differences in time; its setting is the
/// grid's step, world units.
class GridPeer : public Peer {
 public:
    Range range(const MeshSequence& clip) const override;
    Expected<void> approximate(const MeshSequence& clip, double step, std::vector<float>& decoded) override;
    Expected<void> encode(const MeshSequence& clip, double step) override;
    Expected<void> decode(std::vector<float>& positions) override;
    std::size_t size_bytes() const override { return coded_.size(); }
    std::string setting_text(double step) const override;

 protected:
    /// Codes differences of levels, [frame][vertex][xyz], folded to unsigned (quantised_deltas.h). row:
    /// values of a frame.
    virtual Expected<void> encode_deltas(const std::vector<std::uint32_t>& deltas, std::size_t row) = 0;
    /// deltas: of the size that was coded.
    virtual Expected<void> decode_deltas(std::vector<std::uint32_t>& deltas) = 0;
    std::vector<std::uint8_t> coded_;

 private:
    double step_ = 0.0;
    std::size_t row_ = 0;
    int order_ = 1;  ///< of prediction in time, of what was coded; named in the setting
    std::vector<std::int32_t> levels_;
    std::vector<std::uint32_t> deltas_;
};

}  // namespace batchenc
