#include "codecs/connectivity_bitstream.h"

#include <algorithm>
#include <array>
#include <limits>
#include <new>
#include <string>

#include "kernels/byte_stream.h"
#include "kernels/connectivity_coder.h"
#include "kernels/crc32c.h"

namespace batchenc {
namespace {

constexpr std::array<std::uint8_t, 4> kMagic = {'B', 'E', 'N', 'M'};
constexpr std::uint8_t kVersion = 1;
constexpr std::uint8_t kAttachmentCoder = 1;  // kernels/connectivity_coder
constexpr std::size_t kChecksumBytes = sizeof(std::uint32_t);
constexpr const char* kWhere = "connectivity bitstream";

tl::unexpected<Error> within(Error error) { return fail_within(kWhere, std::move(error)); }

}  // namespace

Expected<ConnectivityBitstream> write_connectivity_bitstream(std::span<const Triangle> triangles,
                                                             std::int64_t vertex_count) {
    const auto encoded = encode_connectivity(triangles, vertex_count);
    if (!encoded) return within(encoded.error());
    try {
        ByteWriter writer;
        writer.put_bytes(kMagic);
        writer.put(kVersion);
        writer.put(kAttachmentCoder);
        writer.put_varint(static_cast<std::uint64_t>(vertex_count));
        writer.put_varint(triangles.size());
        writer.put_varint(encoded->bytes.size());
        writer.put_bytes(encoded->bytes);
        writer.put(crc32c(writer.bytes()));
        return ConnectivityBitstream{writer.take(), encoded->order_bytes};
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::kOutOfMemory, "no memory for the stream", kWhere);
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
    if (*coder != kAttachmentCoder) {
        return fail(ErrorCode::kUnsupported, "connectivity coder " + std::to_string(*coder), kWhere);
    }
    constexpr std::uint64_t kMostCounted = std::numeric_limits<std::int32_t>::max();
    const auto stated_vertex_count = reader.get_varint(kMostCounted);
    if (!stated_vertex_count) return within(stated_vertex_count.error());
    if (static_cast<std::int64_t>(*stated_vertex_count) != vertex_count) {
        return fail(ErrorCode::kCorrupt,
                    "is for " + std::to_string(*stated_vertex_count) + " vertices, not " +
                        std::to_string(vertex_count),
                    kWhere);
    }
    const auto triangle_count = reader.get_varint(std::numeric_limits<std::int64_t>::max());
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
    auto triangles = decode_connectivity(*payload, static_cast<std::int64_t>(*triangle_count), vertex_count);
    if (!triangles) return within(triangles.error());
    return triangles;
}

}  // namespace batchenc
