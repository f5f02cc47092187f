#include <zfp.h>

#include <cstdio>

#include "bench/peers/peer.h"
#include "bench/peers/time_rows.h"
#include "kernels/bounding_box.h"

namespace batchenc {
namespace {

/// zfp with a fixed accuracy over the plane of TimeRows. zfp takes its accuracy as a power of two; the
/// unit is therefore what is searched for: values are divided by it and coded to an accuracy of 1.
class ZfpPeer final : public Peer {
 public:
    explicit ZfpPeer(bool in_mesh_order) : rows_(in_mesh_order) {}
    std::string name() const override { return rows_.in_mesh_order() ? "zfp-mesh-order" : "zfp"; }
    std::size_t size_bytes() const override { return coded_.size(); }
    std::string setting_text(double unit) const override {
        char text[64];
        std::snprintf(text, sizeof text, "accuracy %.4g", unit);
        return text;
    }
    Range range(const MeshSequence& clip) const override {
        const double diagonal = bounding_box(clip.view()).diagonal();
        return {1e-6 * diagonal, diagonal};
    }

    Expected<void> encode(const MeshSequence& clip, double unit) override {
        unit_ = unit;
        rows_.take_shape(clip);
        rows_.gather(clip, unit, values_);
        coded_.clear();
        const std::size_t size = run(zfp_compress);
        if (size == 0) return fail(ErrorCode::kNumerical, "zfp cannot code this");
        coded_.resize(size);
        return {};
    }
    Expected<void> decode(std::vector<float>& positions) override {
        if (run(zfp_decompress) == 0) return fail(ErrorCode::kCorrupt, "zfp cannot decode its own stream");
        rows_.scatter(values_, unit_, positions);
        return {};
    }

 private:
    /// Codes or decodes values_ to or from coded_.
    template <typename Work>
    std::size_t run(Work work) {
        zfp_field* field = zfp_field_2d(values_.data(), zfp_type_float, rows_.frames(), 3 * rows_.vertices());
        zfp_stream* stream = zfp_stream_open(nullptr);
        zfp_stream_set_accuracy(stream, 1.0);
        if (coded_.empty()) coded_.resize(zfp_stream_maximum_size(stream, field));
        bitstream* bits = stream_open(coded_.data(), coded_.size());
        zfp_stream_set_bit_stream(stream, bits);
        zfp_stream_rewind(stream);
        const std::size_t size = work(stream, field);
        stream_close(bits);
        zfp_stream_close(stream);
        zfp_field_free(field);
        return size;
    }

    double unit_ = 1.0;
    TimeRows rows_;
    std::vector<float> values_;
    std::vector<std::uint8_t> coded_;
};

}  // namespace

void add_zfp_peers(Peers& peers) {
    peers.push_back(std::make_unique<ZfpPeer>(false));
    peers.push_back(std::make_unique<ZfpPeer>(true));
}

}  // namespace batchenc
