#include <blosc.h>

#include "bench/peers/grid_peer.h"

namespace batchenc {
namespace {

/// A grid, differences in time, then Blosc's own shuffle and one of its coders, all at level 9.
class BloscPeer final : public GridPeer {
 public:
    BloscPeer(const char* coder, int shuffle) : coder_(coder), shuffle_(shuffle) {}
    std::string name() const override {
        return std::string("blosc-") + coder_ + (shuffle_ == BLOSC_BITSHUFFLE ? "-bits" : "-bytes");
    }

 private:
    Expected<void> encode_deltas(const std::vector<std::uint32_t>& deltas, std::size_t) override {
        coded_.resize(4 * deltas.size() + BLOSC_MAX_OVERHEAD);
        const int size = blosc_compress_ctx(9, shuffle_, 4, 4 * deltas.size(), deltas.data(), coded_.data(),
                                            coded_.size(), coder_, 0, 1);
        if (size <= 0) return fail(ErrorCode::kNumerical, "Blosc cannot code this");
        coded_.resize(static_cast<std::size_t>(size));
        return {};
    }
    Expected<void> decode_deltas(std::vector<std::uint32_t>& deltas) override {
        if (blosc_decompress_ctx(coded_.data(), deltas.data(), 4 * deltas.size(), 1) <= 0)
            return fail(ErrorCode::kCorrupt, "Blosc cannot decode its own stream");
        return {};
    }

    const char* coder_;
    int shuffle_;
};

}  // namespace

void add_blosc_peers(Peers& peers) {
    peers.push_back(std::make_unique<BloscPeer>("lz4", BLOSC_SHUFFLE));
    peers.push_back(std::make_unique<BloscPeer>("zstd", BLOSC_BITSHUFFLE));
}

}  // namespace batchenc
