#include <zstd.h>

#include "bench/peers/grid_peer.h"
#include "bench/peers/quantised_deltas.h"

namespace batchenc {
namespace {

/// A grid, differences in time, the bytes of a kind together, zstd.
class ZstdPeer final : public GridPeer {
 public:
    explicit ZstdPeer(int level) : level_(level) {}
    std::string name() const override { return "zstd-" + std::to_string(level_); }

 private:
    Expected<void> encode_deltas(const std::vector<std::uint32_t>& deltas, std::size_t) override {
        split_bytes(deltas, planes_);
        coded_.resize(ZSTD_compressBound(planes_.size()));
        const std::size_t size =
            ZSTD_compress(coded_.data(), coded_.size(), planes_.data(), planes_.size(), level_);
        if (ZSTD_isError(size)) return fail(ErrorCode::kNumerical, ZSTD_getErrorName(size));
        coded_.resize(size);
        return {};
    }
    Expected<void> decode_deltas(std::vector<std::uint32_t>& deltas) override {
        const std::size_t size =
            ZSTD_decompress(planes_.data(), planes_.size(), coded_.data(), coded_.size());
        if (ZSTD_isError(size)) return fail(ErrorCode::kCorrupt, ZSTD_getErrorName(size));
        join_bytes(planes_, deltas);
        return {};
    }

    int level_;
    std::vector<std::uint8_t> planes_;
};

}  // namespace

void add_zstd_peers(Peers& peers) {
    peers.push_back(std::make_unique<ZstdPeer>(3));
    peers.push_back(std::make_unique<ZstdPeer>(19));
}

}  // namespace batchenc
