#include <algorithm>
#include <cstdio>
#include <limits>

#include "bench/peers/peer.h"
#include "codecs/clip_codec.h"

namespace batchenc {
namespace {

/// A coder of this project, a whole clip at once, segmentation and search included.
class OwnPeer : public Peer {
 public:
    std::size_t size_bytes() const override { return coded_.bitstream.size(); }
    Expected<void> decode(std::vector<float>& positions) override {
        const auto clip = decode_clip(coded_.bitstream, mesh_, -1, std::numeric_limits<std::int64_t>::max(),
                                      SerialExecutor());
        if (!clip) return tl::unexpected(clip.error());
        const ClipInfo& info = (*clip)->info();
        positions.resize(static_cast<std::size_t>(3 * info.frame_count * info.vertex_count));
        return (*clip)->reconstruct(0, {positions.data(), info.frame_count, info.vertex_count},
                                    SerialExecutor());
    }

 protected:
    Expected<void> encode_by(const MeshSequence& clip, const CodecParameters& parameters) {
        if (clip_ != clip.positions.data()) {
            mesh_ = std::make_shared<const MeshTopology>(clip.triangles, clip.vertex_count);
            clip_ = clip.positions.data();
        }
        Segmentation segmentation;
        if (uses_clusters(parameters.method)) {
            auto found = segment_clip(clip.view(), clip.triangles, {.method = SegmentationMethod::kRigid},
                                      SerialExecutor());
            if (!found) return tl::unexpected(found.error());
            segmentation = std::move(*found);
        }
        auto coded = encode_clip(clip.view(), *mesh_, segmentation, parameters, SerialExecutor());
        if (!coded) return tl::unexpected(coded.error());
        coded_ = std::move(*coded);
        return {};
    }

 private:
    const void* clip_ = nullptr;  // whose mesh it is
    SharedMesh mesh_;
    EncodedClip coded_;
};

/// RTPCA, which looks for the step itself; the setting is the error asked for.
class RtpcaPeer final : public OwnPeer {
 public:
    explicit RtpcaPeer(const AskedError& asked) : asked_(asked) {}
    std::string name() const override { return "batchenc-rtpca"; }
    Range range(const MeshSequence&) const override { return {asked_.value, asked_.value}; }
    std::string setting_text(double value) const override {
        char text[64];
        std::snprintf(text, sizeof text, "target %s %.4g", asked_.is_kg ? "kg" : "max_error_relative", value);
        return text;
    }
    Expected<void> encode(const MeshSequence& clip, double value) override {
        CodecParameters parameters;
        parameters.method = CodecMethod::kRtpca;
        (asked_.is_kg ? parameters.target_kg : parameters.max_error_relative) = value;
        return encode_by(clip, parameters);
    }

 private:
    AskedError asked_;
};

/// SplitCoder; the setting is its bound on every vertex over the diagonal.
class SplitcoderPeer final : public OwnPeer {
 public:
    explicit SplitcoderPeer(const AskedError& asked) : asked_(asked) {}
    std::string name() const override { return "batchenc-splitcoder"; }
    Range range(const MeshSequence&) const override {
        if (!asked_.is_kg) return {asked_.value, asked_.value};
        return {1e-6, 0.05};
    }
    std::string setting_text(double bound) const override {
        char text[64];
        std::snprintf(text, sizeof text, "max_error_relative %.4g", bound);
        return text;
    }
    Expected<void> encode(const MeshSequence& clip, double bound) override {
        CodecParameters parameters;
        parameters.method = CodecMethod::kSplitcoder;
        parameters.max_error_relative = bound;
        return encode_by(clip, parameters);
    }

 private:
    AskedError asked_;
};

}  // namespace

void add_own_peers(const AskedError& asked, Peers& peers) {
    peers.push_back(std::make_unique<RtpcaPeer>(asked));
    peers.push_back(std::make_unique<SplitcoderPeer>(asked));
}

}  // namespace batchenc
