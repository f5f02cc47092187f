#include "codecs/connectivity_bitstream.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <limits>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "kernels/byte_stream.h"
#include "kernels/crc32c.h"
#include "tests/support/sample_meshes.h"

namespace batchenc {
namespace {

constexpr std::int64_t kAnyTriangleCount = std::int64_t{1} << 40;

constexpr std::array<MeshOrder, 2> kOrders = {MeshOrder::kPreserve, MeshOrder::kFree};

#include "golden_connectivity_v1.inc"
#include "golden_connectivity_v2.inc"

using Mesh = test::NamedMesh;

// Small ones of every kind.
std::vector<Mesh> meshes() {
    std::vector<Mesh> all = test::every_kind_of_mesh();
    std::erase_if(
        all, [](const Mesh& mesh) { return mesh.triangles.size() > 300 || mesh.vertex_count > 1000000; });
    EXPECT_GT(all.size(), 30u);
    return all;
}
const Mesh kClosed = {"closed", 4, {{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}}};

std::vector<std::uint8_t> written(const Mesh& mesh, MeshOrder order = MeshOrder::kPreserve) {
    auto stream = write_connectivity_bitstream(mesh.triangles, mesh.vertex_count, order);
    EXPECT_TRUE(stream) << stream.error().to_string();
    return stream->bytes;
}

ErrorCode error_of(const std::vector<std::uint8_t>& bytes, std::int64_t vertex_count) {
    const auto result = read_connectivity_bitstream(bytes, vertex_count, kAnyTriangleCount);
    if (result) return ErrorCode{};
    EXPECT_FALSE(result.error().where.empty());
    return result.error().code;
}

// Content with the checksum that makes it trusted, to reach what lies behind the check.
std::vector<std::uint8_t> sealed(ByteWriter content) {
    content.put(crc32c(content.bytes()));
    return content.take();
}

ByteWriter header(std::uint8_t coder, std::uint64_t vertex_count, std::uint64_t triangle_count,
                  std::uint64_t payload_size) {
    ByteWriter writer;
    for (const char c : {'B', 'E', 'N', 'M'}) writer.put(c);
    writer.put<std::uint8_t>(1);
    writer.put(coder);
    writer.put_varint(vertex_count);
    writer.put_varint(triangle_count);
    writer.put_varint(payload_size);
    return writer;
}

// A whole stream of coder 2 around a payload.
std::vector<std::uint8_t> stream_of(std::uint64_t vertex_count, std::uint64_t triangle_count,
                                    const ByteWriter& payload) {
    ByteWriter writer = header(2, vertex_count, triangle_count, payload.size());
    writer.put_bytes(payload.bytes());
    return sealed(writer);
}
ByteWriter payload_of(std::uint8_t order, std::span<const std::uint8_t> surface,
                      std::span<const std::uint8_t> order_bytes) {
    ByteWriter payload;
    payload.put(order);
    payload.put_varint(surface.size());
    payload.put_bytes(surface);
    payload.put_bytes(order_bytes);
    return payload;
}

// The parts of what was written.
struct Parts {
    std::uint8_t order = 255;
    std::vector<std::uint8_t> surface, order_bytes;
};
Parts parts_of(const std::vector<std::uint8_t>& bytes) {
    constexpr std::uint64_t kMost = std::uint64_t{1} << 32;
    Parts parts;
    ByteReader reader(bytes);
    EXPECT_EQ(reader.get<std::uint32_t>(), 0x4d4e4542u);  // BENM
    EXPECT_EQ(reader.get<std::uint8_t>(), 1);             // version
    EXPECT_EQ(reader.get<std::uint8_t>(), 2);             // coder
    EXPECT_TRUE(reader.get_varint(kMost));
    EXPECT_TRUE(reader.get_varint(kMost));
    const auto payload = reader.get_bytes(reader.get_varint(kMost).value());
    EXPECT_TRUE(payload);
    EXPECT_EQ(reader.remaining(), 4u);
    if (!payload) return parts;
    ByteReader inside(*payload);
    parts.order = inside.get<std::uint8_t>().value_or(255);
    const auto surface = inside.get_bytes(inside.get_varint(kMost).value()).value();
    const auto order_bytes = inside.get_bytes(inside.remaining()).value();
    parts.surface.assign(surface.begin(), surface.end());
    parts.order_bytes.assign(order_bytes.begin(), order_bytes.end());
    return parts;
}

TEST(ConnectivityBitstream, RoundTrips) {
    std::mt19937 generator(1);
    for (const Mesh& kind : test::every_kind_of_mesh()) {
        for (const Mesh& mesh : {kind, test::shuffled(kind, generator)}) {
            const auto bytes = written(mesh);
            const auto triangles = read_connectivity_bitstream(bytes, mesh.vertex_count, kAnyTriangleCount);
            ASSERT_TRUE(triangles) << mesh.name << ": " << triangles.error().to_string();
            EXPECT_EQ(*triangles, mesh.triangles) << mesh.name;
            EXPECT_EQ(written({mesh.name, mesh.vertex_count, *triangles}), bytes) << mesh.name;
        }
    }
}

TEST(ConnectivityBitstream, RoundTripsInFreeOrder) {
    std::mt19937 generator(2);
    for (const Mesh& kind : test::every_kind_of_mesh()) {
        if (kind.vertex_count > 1000000) continue;  // a list of all vertices would take gigabytes
        for (const Mesh& mesh : {kind, test::shuffled(kind, generator)}) {
            SCOPED_TRACE(mesh.name);
            const auto stream =
                write_connectivity_bitstream(mesh.triangles, mesh.vertex_count, MeshOrder::kFree);
            ASSERT_TRUE(stream) << stream.error().to_string();
            const auto triangles =
                read_connectivity_bitstream(stream->bytes, mesh.vertex_count, kAnyTriangleCount);
            ASSERT_TRUE(triangles) << triangles.error().to_string();
            EXPECT_EQ(*triangles, stream->triangles);

            // The vertices are the source's in another order, those without a triangle last.
            ASSERT_EQ(static_cast<std::int64_t>(stream->source_vertices.size()), mesh.vertex_count);
            auto sorted = stream->source_vertices;
            std::sort(sorted.begin(), sorted.end());
            for (std::size_t v = 0; v < sorted.size(); ++v)
                ASSERT_EQ(sorted[v], static_cast<std::int32_t>(v));
            std::set<std::int32_t> used;
            for (const Triangle& t : mesh.triangles) used.insert(t.begin(), t.end());
            for (std::size_t v = 0; v < sorted.size(); ++v)
                ASSERT_EQ(used.contains(stream->source_vertices[v]), v < used.size()) << v;
            // So are the triangles, by way of the vertices.
            auto mapped = *triangles;
            for (Triangle& t : mapped) {
                for (std::int32_t& v : t) v = stream->source_vertices[static_cast<std::size_t>(v)];
            }
            EXPECT_EQ(test::without_order(mapped), test::without_order(mesh.triangles));
        }
    }
}

TEST(ConnectivityBitstream, CountsTheBytesOfOrder) {
    std::mt19937 generator(3);
    for (const Mesh& mesh : meshes()) {
        const auto preserved =
            write_connectivity_bitstream(mesh.triangles, mesh.vertex_count, MeshOrder::kPreserve);
        const auto free = write_connectivity_bitstream(mesh.triangles, mesh.vertex_count, MeshOrder::kFree);
        ASSERT_TRUE(preserved && free) << mesh.name;
        EXPECT_EQ(free->order_bytes, 0) << mesh.name;
        const Parts parts = parts_of(preserved->bytes);
        EXPECT_EQ(preserved->order_bytes, static_cast<std::int64_t>(parts.order_bytes.size())) << mesh.name;
        EXPECT_EQ(parts_of(free->bytes).surface, parts.surface) << mesh.name;
        EXPECT_EQ(parts_of(free->bytes).order_bytes.size(), 0u) << mesh.name;
        EXPECT_TRUE(preserved->triangles.empty() && preserved->source_vertices.empty()) << mesh.name;
    }
    const Mesh mesh = test::shuffled({"", 900, test::grid(30, 30)}, generator);
    const auto stream = write_connectivity_bitstream(mesh.triangles, mesh.vertex_count, MeshOrder::kPreserve);
    EXPECT_GT(stream->order_bytes, 1000);
    EXPECT_LT(written(mesh, MeshOrder::kFree).size(), 60u);
}

TEST(ConnectivityBitstream, HasTheLayoutOfTheFormat) {
    for (const MeshOrder order : kOrders) {
        const auto bytes = written({"", 300, {{0, 1, 2}, {0, 2, 3}}}, order);
        ByteReader reader(bytes);
        EXPECT_EQ(reader.get<std::uint32_t>(), 0x4d4e4542u);  // BENM
        EXPECT_EQ(reader.get<std::uint8_t>(), 1);             // version
        EXPECT_EQ(reader.get<std::uint8_t>(), 2);             // coder
        EXPECT_EQ(reader.get_varint(1000), 300u);
        EXPECT_EQ(reader.get_varint(1000), 2u);
        const auto size = reader.get_varint(1000);
        ASSERT_TRUE(size);
        ASSERT_EQ(reader.remaining(), *size + 4);
        ASSERT_TRUE(reader.get_bytes(*size));
        EXPECT_EQ(reader.get<std::uint32_t>(), crc32c(std::span(bytes).first(bytes.size() - 4)));
        const Parts parts = parts_of(bytes);
        EXPECT_EQ(parts.order, order == MeshOrder::kFree ? 0 : 1);
        EXPECT_FALSE(parts.surface.empty());
        EXPECT_EQ(parts.order_bytes.empty(), order == MeshOrder::kFree);
    }
}

// Results that are there already are read for ever.
TEST(ConnectivityBitstream, DecodesTheGoldenStreamOfCoder1) {
    const auto triangles = read_connectivity_bitstream(kGoldenConnectivityV1, 70001, 6);
    ASSERT_TRUE(triangles) << triangles.error().to_string();
    EXPECT_EQ(*triangles, (std::vector<Triangle>{
                              {0, 1, 2}, {0, 2, 3}, {4, 3, 2}, {2, 1, 5}, {9, 70000, 8}, {8, 70000, 6}}));
    EXPECT_EQ(error_of(kGoldenConnectivityV1, 70000), ErrorCode::kCorrupt);
}

TEST(ConnectivityBitstream, DecodesTheGoldenStreamsOfCoder2) {
    const std::vector<Triangle> source = {{0, 1, 2}, {0, 2, 3},   {4, 3, 2},
                                          {2, 1, 5}, {9, 700, 8}, {8, 700, 6}};
    const auto preserved = read_connectivity_bitstream(kGoldenConnectivityV2, 701, 6);
    ASSERT_TRUE(preserved) << preserved.error().to_string();
    EXPECT_EQ(*preserved, source);
    EXPECT_EQ(written({"", 701, source}), kGoldenConnectivityV2);
    const auto free = read_connectivity_bitstream(kGoldenConnectivityV2Free, 701, 6);
    ASSERT_TRUE(free) << free.error().to_string();
    EXPECT_EQ(*free,
              (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}, {3, 2, 4}, {2, 1, 5}, {6, 7, 8}, {8, 7, 9}}));
    EXPECT_EQ(written({"", 701, source}, MeshOrder::kFree), kGoldenConnectivityV2Free);
}

TEST(ConnectivityBitstream, NamesTheTriangleOfAnIndexOutOfRange) {
    for (const MeshOrder order : kOrders) {
        for (const std::int32_t bad : {-1, 3, std::numeric_limits<std::int32_t>::max()}) {
            const std::vector<Triangle> triangles = {{0, 1, 2}, {0, bad, 1}};
            const auto result = write_connectivity_bitstream(triangles, 3, order);
            ASSERT_FALSE(result);
            EXPECT_EQ(result.error().code, ErrorCode::kOutOfRange);
            EXPECT_NE(result.error().message.find("triangle 1 has vertex " + std::to_string(bad)),
                      std::string::npos);
        }
        for (const std::int64_t count : {std::int64_t{-1}, std::int64_t{1} << 31}) {
            EXPECT_EQ(write_connectivity_bitstream({}, count, order).error().code,
                      ErrorCode::kInvalidArgument);
        }
    }
}

TEST(ConnectivityBitstream, RejectsEveryTruncation) {
    for (const Mesh& mesh : meshes())
        for (const MeshOrder order : kOrders) {
            const auto bytes = written(mesh, order);
            for (std::size_t size = 0; size < bytes.size(); ++size) {
                const auto cut = std::make_unique<std::uint8_t[]>(size);
                std::copy_n(bytes.begin(), size, cut.get());
                const auto result =
                    read_connectivity_bitstream({cut.get(), size}, mesh.vertex_count, kAnyTriangleCount);
                ASSERT_FALSE(result) << mesh.name << " " << size;
                ASSERT_EQ(result.error().code, size < 4 ? ErrorCode::kFormat : ErrorCode::kCorrupt);
            }
        }
}

TEST(ConnectivityBitstream, RejectsExtraBytes) {
    for (const Mesh& mesh : meshes())
        for (const MeshOrder order : kOrders) {
            auto bytes = written(mesh, order);
            bytes.push_back(0);
            EXPECT_EQ(error_of(bytes, mesh.vertex_count), ErrorCode::kCorrupt) << mesh.name;
        }
    // behind the payload, under a matching checksum; and inside the payload
    ByteWriter behind = header(1, 5, 0, 0);
    behind.put<std::uint8_t>(0);
    EXPECT_EQ(error_of(sealed(behind), 5), ErrorCode::kCorrupt);
    ByteWriter inside = header(1, 5, 0, 1);
    inside.put<std::uint8_t>(0);
    EXPECT_EQ(error_of(sealed(inside), 5), ErrorCode::kCorrupt);
    EXPECT_EQ(error_of(sealed(header(1, 5, 0, 0)), 5), ErrorCode{});  // the same without them is a stream
}

TEST(ConnectivityBitstream, RejectsBadMagic) {
    auto bytes = written(kClosed);
    bytes[3] = 'X';
    EXPECT_EQ(error_of(bytes, 4), ErrorCode::kFormat);
    EXPECT_EQ(error_of({}, 4), ErrorCode::kFormat);
}

TEST(ConnectivityBitstream, RejectsFutureVersionAndCoder) {
    auto bytes = written(kClosed);
    bytes[4] = 2;
    EXPECT_EQ(error_of(bytes, 4), ErrorCode::kUnsupported);
    for (const int coder : {0, 3, 255})
        EXPECT_EQ(error_of(sealed(header(static_cast<std::uint8_t>(coder), 4, 0, 0)), 4),
                  ErrorCode::kUnsupported)
            << coder;
}

TEST(ConnectivityBitstream, RefusesOrdersThatItDoesNotKnow) {
    const Parts parts = parts_of(written(kClosed));
    for (const int order : {2, 3, 255}) {
        const auto payload = payload_of(static_cast<std::uint8_t>(order), parts.surface, parts.order_bytes);
        EXPECT_EQ(error_of(stream_of(4, 4, payload), 4), ErrorCode::kUnsupported) << order;
    }
    EXPECT_EQ(error_of(stream_of(4, 4, payload_of(1, parts.surface, parts.order_bytes)), 4), ErrorCode{});
}

TEST(ConnectivityBitstream, RefusesPartsThatDoNotBelong) {
    const Parts parts = parts_of(written(kClosed));
    ASSERT_FALSE(parts.order_bytes.empty());
    const std::vector<std::uint8_t> none;
    const auto read = [&](std::uint8_t order, std::span<const std::uint8_t> surface,
                          std::span<const std::uint8_t> order_bytes) {
        return error_of(stream_of(4, 4, payload_of(order, surface, order_bytes)), 4);
    };
    EXPECT_EQ(read(0, parts.surface, none), ErrorCode{});
    EXPECT_EQ(read(0, parts.surface, parts.order_bytes), ErrorCode::kCorrupt);  // an order though it is free
    EXPECT_EQ(read(1, parts.surface, none), ErrorCode::kCorrupt);               // none though it is kept
    EXPECT_EQ(read(1, none, parts.order_bytes), ErrorCode::kCorrupt);
    auto longer = parts.surface;
    longer.push_back(1);
    EXPECT_EQ(read(0, longer, none), ErrorCode::kCorrupt);
    longer = parts.order_bytes;
    longer.push_back(1);
    EXPECT_EQ(read(1, parts.surface, longer), ErrorCode::kCorrupt);
    ByteWriter beyond;  // a surface that is longer than the payload
    beyond.put<std::uint8_t>(0);
    beyond.put_varint(parts.surface.size() + 1);
    beyond.put_bytes(parts.surface);
    EXPECT_EQ(error_of(stream_of(4, 4, beyond), 4), ErrorCode::kCorrupt);
    EXPECT_EQ(error_of(stream_of(4, 4, ByteWriter()), 4), ErrorCode::kCorrupt);
    // Nothing coded is a surface of no triangles.
    EXPECT_EQ(error_of(stream_of(4, 0, payload_of(0, none, none)), 4), ErrorCode{});
    EXPECT_EQ(error_of(stream_of(4, 0, payload_of(1, none, none)), 4), ErrorCode{});
}

TEST(ConnectivityBitstream, ReadsAsManyTrianglesAsItStates) {
    const auto mesh = test::torus(12, 9);
    const Parts parts = parts_of(written({"", 108, mesh}, MeshOrder::kFree));
    const std::vector<std::uint8_t> none;
    for (std::uint64_t count = 0; count < 2 * mesh.size(); ++count) {
        const auto bytes = stream_of(108, count, payload_of(0, parts.surface, none));
        const auto triangles = read_connectivity_bitstream(bytes, 108, kAnyTriangleCount);
        if (triangles) {
            EXPECT_EQ(triangles->size(), count);
        }
        if (count == mesh.size()) {
            EXPECT_TRUE(triangles);
        }
    }
}

TEST(ConnectivityBitstream, RejectsEveryFlippedBit) {
    for (const Mesh& mesh : meshes())
        for (const MeshOrder order : kOrders) {
            const auto bytes = written(mesh, order);
            for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
                auto flipped = bytes;
                flipped[bit / 8] ^= static_cast<std::uint8_t>(1u << (bit % 8));
                ASSERT_NE(error_of(flipped, mesh.vertex_count), ErrorCode{}) << mesh.name << " bit " << bit;
            }
        }
}

TEST(ConnectivityBitstream, RejectsAnotherVertexCount) {
    const auto bytes = written(kClosed);
    EXPECT_EQ(error_of(bytes, 5), ErrorCode::kCorrupt);
    EXPECT_EQ(error_of(bytes, -1), ErrorCode::kCorrupt);
}

TEST(ConnectivityBitstream, RejectsImpossibleCountsBeforeAllocating) {
    constexpr std::uint64_t kMost = (std::uint64_t{1} << 63) - 1;
    for (const std::uint64_t triangle_count : {std::uint64_t{1}, std::uint64_t{1} << 40, kMost}) {
        EXPECT_EQ(error_of(sealed(header(1, 4, triangle_count, 0)), 4), ErrorCode::kCorrupt);
        EXPECT_EQ(error_of(sealed(header(2, 4, triangle_count, 0)), 4), ErrorCode::kCorrupt);
        const std::vector<std::uint8_t> none;
        for (const std::uint8_t order : {std::uint8_t{0}, std::uint8_t{1}}) {
            EXPECT_EQ(error_of(stream_of(4, triangle_count, payload_of(order, none, none)), 4),
                      ErrorCode::kCorrupt);
        }
    }
    EXPECT_EQ(error_of(sealed(header(1, std::uint64_t{1} << 31, 0, 0)), std::int64_t{1} << 31),
              ErrorCode::kCorrupt);
    EXPECT_EQ(error_of(sealed(header(1, 4, 0, kMost)), 4), ErrorCode::kCorrupt);
}

// Damage that an attacker sealed again: any answer but a crash, and never an index out of range.
TEST(ConnectivityBitstream, SurvivesDamageUnderAMatchingChecksum) {
    for (const Mesh& mesh : meshes())
        for (const MeshOrder order : kOrders) {
            const auto bytes = written(mesh, order);
            for (std::size_t bit = 6 * 8; bit < 8 * (bytes.size() - 4); ++bit) {
                ByteWriter writer;
                writer.put_bytes(std::span(bytes).first(bytes.size() - 4));
                auto content = writer.take();
                content[bit / 8] ^= static_cast<std::uint8_t>(1u << (bit % 8));
                ByteWriter damaged;
                damaged.put_bytes(content);
                const auto result =
                    read_connectivity_bitstream(sealed(damaged), mesh.vertex_count, kAnyTriangleCount);
                if (!result) continue;
                for (const Triangle& t : *result) {
                    for (const std::int32_t v : t) ASSERT_TRUE(v >= 0 && v < mesh.vertex_count);
                }
            }
        }
}

TEST(ConnectivityBitstream, RefusesMoreTrianglesThanExpected) {
    const std::vector<Triangle> triangles(1000, Triangle{0, 1, 2});
    const auto written = write_connectivity_bitstream(triangles, 3, MeshOrder::kPreserve);
    ASSERT_TRUE(written);
    EXPECT_TRUE(read_connectivity_bitstream(written->bytes, 3, 1000));
    const auto refused = read_connectivity_bitstream(written->bytes, 3, 999);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::kCorrupt);
}

}  // namespace
}  // namespace batchenc
