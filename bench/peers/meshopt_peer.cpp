#include <meshoptimizer.h>
#include <zstd.h>

#include <algorithm>

#include "bench/peers/grid_peer.h"

namespace batchenc {
namespace {

/// A grid, differences in time, each frame through meshoptimizer's coder of vertex buffers, all of that
/// through zstd 19. A vertex is three 16-bit numbers and two bytes of nothing where all fit, else three of
/// 32 bits.
class MeshoptPeer final : public GridPeer {
 public:
    std::string name() const override { return "meshoptimizer+zstd-19"; }

 private:
    Expected<void> encode_deltas(const std::vector<std::uint32_t>& deltas, std::size_t row) override {
        row_ = row;
        const std::uint32_t largest = *std::max_element(deltas.begin(), deltas.end());
        vertex_bytes_ = largest < 1u << 16 ? 8 : 12;
        const std::size_t vertices = row / 3, frames = deltas.size() / row;
        std::vector<std::uint8_t> buffers;
        std::vector<std::uint8_t> buffer(meshopt_encodeVertexBufferBound(vertices, vertex_bytes_));
        meshopt_encodeVertexVersion(0);
        sizes_.clear();
        for (std::size_t f = 0; f < frames; ++f) {
            pack(deltas.data() + f * row);
            const std::size_t size = meshopt_encodeVertexBuffer(buffer.data(), buffer.size(), packed_.data(),
                                                                vertices, vertex_bytes_);
            if (size == 0) return fail(ErrorCode::kNumerical, "meshoptimizer cannot code this");
            sizes_.push_back(size);
            buffers.insert(buffers.end(), buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(size));
        }
        buffers_size_ = buffers.size();
        coded_.resize(ZSTD_compressBound(buffers.size()));
        const std::size_t size =
            ZSTD_compress(coded_.data(), coded_.size(), buffers.data(), buffers.size(), 19);
        if (ZSTD_isError(size)) return fail(ErrorCode::kNumerical, ZSTD_getErrorName(size));
        coded_.resize(size);
        return {};
    }

    Expected<void> decode_deltas(std::vector<std::uint32_t>& deltas) override {
        std::vector<std::uint8_t> buffers(buffers_size_);
        const std::size_t size =
            ZSTD_decompress(buffers.data(), buffers.size(), coded_.data(), coded_.size());
        if (ZSTD_isError(size)) return fail(ErrorCode::kCorrupt, ZSTD_getErrorName(size));
        std::size_t at = 0;
        for (std::size_t f = 0; f < sizes_.size(); ++f) {
            if (meshopt_decodeVertexBuffer(packed_.data(), row_ / 3, vertex_bytes_, buffers.data() + at,
                                           sizes_[f]) != 0)
                return fail(ErrorCode::kCorrupt, "meshoptimizer cannot decode its own stream");
            unpack(deltas.data() + f * row_);
            at += sizes_[f];
        }
        return {};
    }

    void pack(const std::uint32_t* values) {
        packed_.assign(row_ / 3 * vertex_bytes_, 0);
        const std::size_t bytes = vertex_bytes_ == 8 ? 2 : 4;
        for (std::size_t k = 0; k < row_; ++k) {
            for (std::size_t b = 0; b < bytes; ++b)
                packed_[k / 3 * vertex_bytes_ + k % 3 * bytes + b] =
                    static_cast<std::uint8_t>(values[k] >> 8 * b);
        }
    }
    void unpack(std::uint32_t* values) const {
        const std::size_t bytes = vertex_bytes_ == 8 ? 2 : 4;
        for (std::size_t k = 0; k < row_; ++k) {
            values[k] = 0;
            for (std::size_t b = 0; b < bytes; ++b)
                values[k] |= std::uint32_t{packed_[k / 3 * vertex_bytes_ + k % 3 * bytes + b]} << 8 * b;
        }
    }

    std::size_t row_ = 0, vertex_bytes_ = 8, buffers_size_ = 0;
    std::vector<std::size_t> sizes_;  // of the frames; not counted, a few bytes each
    std::vector<std::uint8_t> packed_;
};

}  // namespace

void add_meshopt_peers(Peers& peers) { peers.push_back(std::make_unique<MeshoptPeer>()); }

}  // namespace batchenc
