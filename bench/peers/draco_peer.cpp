#include <draco/compression/decode.h>
#include <draco/compression/encode.h>
#include <draco/mesh/mesh.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdio>
#include <memory>
#include <utility>

#include "bench/peers/peer.h"
#include "kernels/bounding_box.h"

namespace batchenc {
namespace {

using Status = draco::Status;

std::unique_ptr<draco::Mesh> mesh_without_positions(const MeshSequence& clip) {
    auto mesh = std::make_unique<draco::Mesh>();
    mesh->set_num_points(static_cast<std::uint32_t>(clip.vertex_count));
    mesh->SetNumFaces(clip.triangles.size());
    for (std::size_t t = 0; t < clip.triangles.size(); ++t) {
        draco::Mesh::Face face;
        for (std::size_t k = 0; k < 3; ++k)
            face[k] = draco::PointIndex(static_cast<std::uint32_t>(clip.triangles[t][k]));
        mesh->SetFace(draco::FaceIndex(static_cast<std::uint32_t>(t)), face);
    }
    return mesh;
}

/// positions: three values a vertex.
void add_positions(draco::Mesh& mesh, const float* positions) {
    auto attribute = std::make_unique<draco::PointAttribute>();
    attribute->Init(draco::GeometryAttribute::POSITION, 3, draco::DT_FLOAT32, false, mesh.num_points());
    for (std::uint32_t v = 0; v < mesh.num_points(); ++v)
        attribute->SetAttributeValue(draco::AttributeValueIndex(v), positions + std::size_t{3} * v);
    mesh.AddAttribute(std::move(attribute));
}

/// Every frame as a Draco mesh of its own, by edgebreaker. Draco knows no sequences, so that every frame
/// carries the connectivity; without it the bytes of as many meshes of the same connectivity with all
/// vertices in one point are taken off. The grid is the same for all frames; its setting is the step.
class DracoPeer final : public Peer {
 public:
    /// level: of compression, 0 … 10.
    DracoPeer(int level, bool counts_connectivity)
        : level_(level), counts_connectivity_(counts_connectivity) {}
    std::string name() const override {
        return "draco-" + std::to_string(level_) + (counts_connectivity_ ? "-with-connectivity" : "");
    }
    std::size_t size_bytes() const override {
        std::size_t sum = 0;
        for (const auto& frame : frames_) sum += frame.size();
        return counts_connectivity_ ? sum : sum - connectivity_bytes_ * frames_.size();
    }
    std::string setting_text(double step) const override {
        char text[64];
        std::snprintf(text, sizeof text, "step %.4g, %d bits", step, bits_);
        return text;
    }
    Range range(const MeshSequence& clip) const override {
        const BoundingBox box = bounding_box(clip.view());
        return {box.diagonal() / (1 << 26), 0.1 * box.diagonal()};
    }
    Expected<void> approximate(const MeshSequence& clip, double step, std::vector<float>& decoded) override {
        const BoundingBox box = bounding_box(clip.view());
        decoded.resize(clip.positions.size());
        for (std::size_t k = 0; k < decoded.size(); ++k) {
            const double low = static_cast<double>(box.low[k % 3]);
            const double level = std::floor((static_cast<double>(clip.positions[k]) - low) / step + 0.5);
            decoded[k] = static_cast<float>(low + step * level);
        }
        return {};
    }

    Expected<void> encode(const MeshSequence& clip, double step) override {
        if (clip_ != clip.positions.data()) {
            if (auto done = learn(clip); !done) return done;
        }
        const BoundingBox box = bounding_box(clip.view());
        double extent = 0.0;
        for (std::size_t axis = 0; axis < 3; ++axis)
            extent =
                std::max(extent, static_cast<double>(box.high[axis]) - static_cast<double>(box.low[axis]));
        bits_ = std::clamp(static_cast<int>(std::ceil(std::log2(extent / step + 1.0))), 2, 30);
        const auto range = static_cast<float>(step * (std::exp2(bits_) - 1.0));
        frames_.resize(static_cast<std::size_t>(clip.frame_count));
        for (std::int64_t f = 0; f < clip.frame_count; ++f) {
            auto mesh = mesh_without_positions(clip);
            add_positions(*mesh, clip.view().at(f, 0));
            if (auto done =
                    encode_mesh(*mesh, bits_, box.low.data(), range, frames_[static_cast<std::size_t>(f)]);
                !done)
                return done;
        }
        return {};
    }

    Expected<void> decode(std::vector<float>& positions) override {
        positions.resize(3 * vertices_ * frames_.size());
        for (std::size_t f = 0; f < frames_.size(); ++f) {
            const auto mesh = decode_mesh(frames_[f]);
            if (!mesh) return tl::unexpected(mesh.error());
            const auto* attribute = (*mesh)->GetNamedAttribute(draco::GeometryAttribute::POSITION);
            if (attribute == nullptr || (*mesh)->num_points() != vertex_of_.size())
                return fail(ErrorCode::kCorrupt, "Draco decodes another mesh");
            for (std::uint32_t p = 0; p < (*mesh)->num_points(); ++p)
                attribute->GetMappedValue(draco::PointIndex(p),
                                          positions.data() + 3 * (f * vertices_ + vertex_of_[p]));
        }
        return {};
    }

 private:
    Expected<void> encode_mesh(const draco::Mesh& mesh, int bits, const float* origin, float range,
                               std::vector<char>& coded) const {
        draco::Encoder encoder;
        encoder.SetSpeedOptions(10 - level_, 10 - level_);
        encoder.SetEncodingMethod(draco::MESH_EDGEBREAKER_ENCODING);
        encoder.SetAttributeExplicitQuantization(draco::GeometryAttribute::POSITION, bits, 3, origin, range);
        draco::EncoderBuffer buffer;
        if (const Status status = encoder.EncodeMeshToBuffer(mesh, &buffer); !status.ok())
            return fail(ErrorCode::kNumerical, "Draco: " + status.error_msg_string());
        coded.assign(buffer.data(), buffer.data() + buffer.size());
        return {};
    }
    static Expected<std::unique_ptr<draco::Mesh>> decode_mesh(const std::vector<char>& coded) {
        draco::DecoderBuffer buffer;
        buffer.Init(coded.data(), coded.size());
        auto mesh = draco::Decoder().DecodeMeshFromBuffer(&buffer);
        if (!mesh.ok()) return fail(ErrorCode::kCorrupt, "Draco: " + mesh.status().error_msg_string());
        return std::move(mesh).value();
    }

    /// Which vertex of the clip each decoded point is: by a mesh whose vertices have their numbers for
    /// positions, as the order of points follows from connectivity alone. And what connectivity costs.
    Expected<void> learn(const MeshSequence& clip) {
        vertices_ = static_cast<std::size_t>(clip.vertex_count);
        const int bits = std::max(2, static_cast<int>(std::bit_width(vertices_)));
        const auto range = static_cast<float>((1 << bits) - 1);  // a step of 1
        const std::array<float, 3> origin{};
        std::vector<float> positions(3 * vertices_);
        const auto code = [&](std::vector<char>& coded) {
            auto mesh = mesh_without_positions(clip);
            add_positions(*mesh, positions.data());
            return encode_mesh(*mesh, bits, origin.data(), range, coded);
        };
        std::vector<char> coded;
        if (auto done = code(coded); !done) return done;
        connectivity_bytes_ = coded.size();
        for (std::size_t v = 0; v < vertices_; ++v) positions[3 * v] = static_cast<float>(v);
        if (auto done = code(coded); !done) return done;
        const auto decoded = decode_mesh(coded);
        if (!decoded) return tl::unexpected(decoded.error());
        const auto* found = (*decoded)->GetNamedAttribute(draco::GeometryAttribute::POSITION);
        if (found == nullptr) return fail(ErrorCode::kCorrupt, "Draco loses positions");
        vertex_of_.resize((*decoded)->num_points());
        std::vector<bool> is_found(vertices_);
        for (std::uint32_t p = 0; p < (*decoded)->num_points(); ++p) {
            std::array<float, 3> position{};
            found->GetMappedValue(draco::PointIndex(p), position.data());
            const long number = std::lround(position[0]);
            if (number < 0 || static_cast<std::size_t>(number) >= vertices_)
                return fail(ErrorCode::kCorrupt, "Draco invents vertices");
            vertex_of_[p] = static_cast<std::size_t>(number);
            is_found[vertex_of_[p]] = true;
        }
        if (std::find(is_found.begin(), is_found.end(), false) != is_found.end())
            return fail(ErrorCode::kUnsupported, "Draco leaves out vertices without triangles");
        clip_ = clip.positions.data();
        return {};
    }

    int level_;
    bool counts_connectivity_;
    int bits_ = 0;
    const void* clip_ = nullptr;  // which is learnt
    std::size_t vertices_ = 0, connectivity_bytes_ = 0;
    std::vector<std::size_t> vertex_of_;  // of every decoded point
    std::vector<std::vector<char>> frames_;
};

}  // namespace

void add_draco_peers(Peers& peers) {
    peers.push_back(std::make_unique<DracoPeer>(7, false));
    peers.push_back(std::make_unique<DracoPeer>(10, false));
    peers.push_back(std::make_unique<DracoPeer>(10, true));
}

}  // namespace batchenc
