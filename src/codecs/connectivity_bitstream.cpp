#include "codecs/connectivity_bitstream.h"

#include <algorithm>
#include <array>
#include <limits>
#include <new>
#include <string>

#include "kernels/attachment_decoder.h"
#include "kernels/bit_coder.h"
#include "kernels/byte_stream.h"
#include "kernels/crc32c.h"
#include "kernels/order_coder.h"
#include "kernels/surface.h"
#include "kernels/surface_coder.h"

namespace batchenc {
namespace {

constexpr std::array<std::uint8_t, 4> kMagic = {'B', 'E', 'N', 'M'};
constexpr std::uint8_t kVersion = 1;
constexpr std::uint8_t kAttachmentCoder = 1;  // kernels/attachment_decoder: read, never written
constexpr std::uint8_t kSurfaceCoder = 2;     // kernels/surface_coder, kernels/order_coder
constexpr std::int64_t kMostVertices = std::numeric_limits<std::int32_t>::max();
constexpr std::size_t kMostTriangles = kMostVertices / 3;  // half-edges have numbers of 31 bits
constexpr std::size_t kChecksumBytes = sizeof(std::uint32_t);
constexpr const char* kWhere = "connectivity bitstream";

tl::unexpected<Error> within(Error error) { return fail_within(kWhere, std::move(error)); }

/// Appends the vertices of 0 … vertex_count - 1 that are not there.
void append_others(std::vector<std::int32_t>& vertices, std::int64_t vertex_count) {
    std::vector<bool> is_there(static_cast<std::size_t>(vertex_count), false);
    for (const std::int32_t v : vertices) is_there[static_cast<std::size_t>(v)] = true;
    for (std::size_t v = 0; v < is_there.size(); ++v) {
        if (!is_there[v]) vertices.push_back(static_cast<std::int32_t>(v));
    }
}

/// Triangles of coder 2.
Expected<std::vector<Triangle>> read_surface(std::span<const std::uint8_t> payload,
                                             std::int64_t triangle_count, std::int64_t vertex_count) {
    ByteReader reader(payload);
    const auto order = reader.get<std::uint8_t>();
    if (!order) return tl::unexpected(order.error());
    if (*order > static_cast<std::uint8_t>(MeshOrder::kPreserve))
        return fail(ErrorCode::kUnsupported, "vertex order " + std::to_string(*order));
    const auto surface_size = reader.get_varint(reader.remaining());
    if (!surface_size) return tl::unexpected(surface_size.error());
    const auto surface_bytes = reader.get_bytes(*surface_size);
    const auto order_bytes = reader.get_bytes(reader.remaining());
    if (!surface_bytes || !order_bytes) return fail(ErrorCode::kCorrupt, "the stream ends too early");
    try {
        BitCoder coder(*surface_bytes);
        auto surface = decode_surface(coder, triangle_count, vertex_count);
        if (!surface) return tl::unexpected(surface.error());
        if (auto end = coder.check_end(); !end) return tl::unexpected(end.error());
        if (*order == static_cast<std::uint8_t>(MeshOrder::kFree)) {
            if (!order_bytes->empty()) return fail(ErrorCode::kCorrupt, "an order where none is wanted");
            return std::move(surface->triangles);
        }
        BitCoder order_coder(*order_bytes);
        auto triangles = decode_order(order_coder, *surface, vertex_count);
        if (!triangles) return tl::unexpected(triangles.error());
        if (auto end = order_coder.check_end(); !end) return tl::unexpected(end.error());
        return triangles;
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::kOutOfMemory,
                    "no memory for " + std::to_string(triangle_count) + " triangles");
    }
}

}  // namespace

Expected<ConnectivityBitstream> write_connectivity_bitstream(std::span<const Triangle> triangles,
                                                             std::int64_t vertex_count, MeshOrder order) {
    if (vertex_count < 0 || vertex_count > kMostVertices)
        return fail(ErrorCode::kInvalidArgument, "a vertex count of " + std::to_string(vertex_count), kWhere);
    if (triangles.size() > kMostTriangles)
        return fail(
            ErrorCode::kLimit,
            std::to_string(triangles.size()) + " triangles are more than " + std::to_string(kMostTriangles),
            kWhere);
    for (std::size_t i = 0; i < triangles.size(); ++i) {
        for (const std::int32_t v : triangles[i]) {
            if (v < 0 || v >= vertex_count)
                return fail(ErrorCode::kOutOfRange,
                            "triangle " + std::to_string(i) + " has vertex " + std::to_string(v) + ", of " +
                                std::to_string(vertex_count),
                            kWhere);
        }
    }
    try {
        ConnectivityBitstream stream;
        BitCoder coder;
        CodedSurface surface = encode_surface(coder, Surface::of(triangles));
        const std::vector<std::uint8_t> surface_bytes = coder.finish();
        ByteWriter payload;
        payload.put(static_cast<std::uint8_t>(order));
        payload.put_varint(surface_bytes.size());
        payload.put_bytes(surface_bytes);
        if (order == MeshOrder::kPreserve) {
            BitCoder order_coder;
            encode_order(order_coder, surface, triangles, vertex_count);
            const std::vector<std::uint8_t> order_bytes = order_coder.finish();
            payload.put_bytes(order_bytes);
            stream.order_bytes = static_cast<std::int64_t>(order_bytes.size());
        } else {
            stream.triangles = std::move(surface.triangles);
            stream.source_vertices = std::move(surface.source_vertex);
            append_others(stream.source_vertices, vertex_count);
        }
        ByteWriter writer;
        writer.put_bytes(kMagic);
        writer.put(kVersion);
        writer.put(kSurfaceCoder);
        writer.put_varint(static_cast<std::uint64_t>(vertex_count));
        writer.put_varint(triangles.size());
        writer.put_varint(payload.size());
        writer.put_bytes(payload.bytes());
        writer.put(crc32c(writer.bytes()));
        stream.bytes = writer.take();
        return stream;
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::kOutOfMemory,
                    "no memory to code " + std::to_string(triangles.size()) + " triangles", kWhere);
    }
}

Expected<std::vector<Triangle>> read_connectivity_bitstream(std::span<const std::uint8_t> bytes,
                                                            std::int64_t vertex_count,
                                                            std::int64_t max_triangle_count) {
    if (bytes.size() < kMagic.size() || !std::equal(kMagic.begin(), kMagic.end(), bytes.begin())) {
        return fail(ErrorCode::kFormat, "does not begin with BENM", kWhere);
    }
    // The version is judged before the checksum: a later one may put its checksum elsewhere.
    ByteReader reader(bytes.subspan(kMagic.size()));
    const auto version = reader.get<std::uint8_t>();
    if (!version) return within(version.error());
    if (*version != kVersion) {
        return fail(
            ErrorCode::kUnsupported,
            "version " + std::to_string(*version) + "; this build reads version " + std::to_string(kVersion),
            kWhere);
    }
    if (reader.remaining() < kChecksumBytes)
        return fail(ErrorCode::kCorrupt, "the stream ends too early", kWhere);
    const auto content = bytes.first(bytes.size() - kChecksumBytes);
    const auto checksum = ByteReader(bytes.last(kChecksumBytes)).get<std::uint32_t>();
    if (!checksum) return within(checksum.error());
    if (*checksum != crc32c(content)) return fail(ErrorCode::kCorrupt, "the checksum does not match", kWhere);

    reader = ByteReader(content.subspan(kMagic.size() + sizeof(kVersion)));
    const auto coder = reader.get<std::uint8_t>();
    if (!coder) return within(coder.error());
    if (*coder != kAttachmentCoder && *coder != kSurfaceCoder) {
        return fail(ErrorCode::kUnsupported, "connectivity coder " + std::to_string(*coder), kWhere);
    }
    const auto stated_vertex_count = reader.get_varint(kMostVertices);
    if (!stated_vertex_count) return within(stated_vertex_count.error());
    if (static_cast<std::int64_t>(*stated_vertex_count) != vertex_count) {
        return fail(ErrorCode::kCorrupt,
                    "is for " + std::to_string(*stated_vertex_count) + " vertices, not " +
                        std::to_string(vertex_count),
                    kWhere);
    }
    const auto triangle_count = reader.get_varint(
        *coder == kSurfaceCoder ? kMostTriangles : std::numeric_limits<std::int64_t>::max());
    if (!triangle_count) return within(triangle_count.error());
    const auto payload_size = reader.get_varint(reader.remaining());
    if (!payload_size) return within(payload_size.error());
    const auto payload = reader.get_bytes(*payload_size);
    if (!payload) return within(payload.error());
    if (reader.remaining() != 0) {
        return fail(ErrorCode::kCorrupt, std::to_string(reader.remaining()) + " bytes too many", kWhere);
    }
    if (*triangle_count > static_cast<std::uint64_t>(max_triangle_count)) {
        return fail(ErrorCode::kCorrupt,
                    "holds " + std::to_string(*triangle_count) + " triangles where at most " +
                        std::to_string(max_triangle_count) + " are expected",
                    kWhere);
    }
    const auto count = static_cast<std::int64_t>(*triangle_count);
    auto triangles = *coder == kSurfaceCoder ? read_surface(*payload, count, vertex_count)
                                             : decode_attachments(*payload, count, vertex_count);
    if (!triangles) return within(triangles.error());
    return triangles;
}

}  // namespace batchenc
