#include <fpzip.h>

#include <string>

#include "bench/peers/peer.h"
#include "bench/peers/time_rows.h"

namespace batchenc {
namespace {

/// fpzip over the planes of TimeRows, one an axis; the setting is how many bits of a float it drops, which
/// is whole, so that its error is mostly well below what is asked for.
class FpzipPeer final : public Peer {
 public:
    explicit FpzipPeer(bool in_mesh_order) : rows_(in_mesh_order) {}
    std::string name() const override { return rows_.in_mesh_order() ? "fpzip-mesh-order" : "fpzip"; }
    std::size_t size_bytes() const override { return coded_.size(); }
    Range range(const MeshSequence&) const override { return {0, 24, true}; }
    std::string setting_text(double dropped) const override {
        return "precision " + std::to_string(32 - static_cast<int>(dropped));
    }

    Expected<void> encode(const MeshSequence& clip, double dropped) override {
        precision_ = 32 - static_cast<int>(dropped);
        rows_.take_shape(clip);
        rows_.gather(clip, 1.0, values_);
        coded_.resize(8 * values_.size() + 4096);
        FPZ* stream = fpzip_write_to_buffer(coded_.data(), coded_.size());
        set_shape(*stream);
        const std::size_t size = fpzip_write(stream, values_.data());
        fpzip_write_close(stream);
        if (size == 0) return fail(ErrorCode::kNumerical, fpzip_errstr[fpzip_errno]);
        coded_.resize(size);
        return {};
    }
    Expected<void> decode(std::vector<float>& positions) override {
        FPZ* stream = fpzip_read_from_buffer(coded_.data());
        set_shape(*stream);
        const std::size_t size = fpzip_read(stream, values_.data());
        fpzip_read_close(stream);
        if (size == 0) return fail(ErrorCode::kCorrupt, fpzip_errstr[fpzip_errno]);
        rows_.scatter(values_, 1.0, positions);
        return {};
    }

 private:
    void set_shape(FPZ& stream) const {
        stream.type = FPZIP_TYPE_FLOAT;
        stream.prec = precision_;
        stream.nx = static_cast<int>(rows_.frames());
        stream.ny = static_cast<int>(rows_.vertices());
        stream.nz = 1;
        stream.nf = 3;
    }

    int precision_ = 32;
    TimeRows rows_;
    std::vector<float> values_;
    std::vector<std::uint8_t> coded_;
};

}  // namespace

void add_fpzip_peers(Peers& peers) {
    peers.push_back(std::make_unique<FpzipPeer>(false));
    peers.push_back(std::make_unique<FpzipPeer>(true));
}

}  // namespace batchenc
