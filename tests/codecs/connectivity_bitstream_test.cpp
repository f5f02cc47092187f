#include "codecs/connectivity_bitstream.h"

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "kernels/byte_stream.h"
#include "kernels/crc32c.h"

namespace batchenc {
namespace {

constexpr std::int64_t kAnyTriangleCount = std::int64_t{1} << 40;

struct Mesh {
    std::string name;
    std::int64_t vertex_count;
    std::vector<Triangle> triangles;
};

std::vector<Mesh> meshes() {
    std::vector<Triangle> grid;
    for (std::int32_t y = 0; y < 9; ++y) {
        for (std::int32_t x = 0; x < 12; ++x) {
            const std::int32_t v = 13 * y + x;
            grid.push_back({v, v + 1, v + 14});
            grid.push_back({v, v + 14, v + 13});
        }
    }
    return {{"nothing", 0, {}},
            {"points", 5, {}},
            {"one triangle", 3, {{2, 0, 1}}},
            {"closed", 4, {{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}}},
            {"boundary", 130, grid},
            {"components", 12, {{0, 1, 2}, {3, 4, 5}, {6, 7, 8}, {8, 7, 9}}},
            {"non-manifold", 6, {{0, 1, 2}, {1, 0, 3}, {0, 1, 4}, {1, 0, 5}, {0, 1, 5}}},
            {"inconsistent winding", 4, {{0, 1, 2}, {1, 2, 3}, {3, 2, 1}}},
            {"degenerate", 3, {{0, 0, 1}, {1, 1, 1}, {2, 0, 2}, {0, 1, 2}}},
            {"repeated", 3, {{0, 1, 2}, {0, 1, 2}, {1, 2, 0}, {0, 1, 2}}},
            {"unused vertices", 1000000, {{999999, 5, 70000}, {5, 999999, 100}}}};
}

std::vector<std::uint8_t> written(const Mesh& mesh) {
    auto stream = write_connectivity_bitstream(mesh.triangles, mesh.vertex_count);
    EXPECT_TRUE(stream) << stream.error().to_string();
    EXPECT_EQ(stream->order_bytes, 0);
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

TEST(ConnectivityBitstream, RoundTrips) {
    for (const Mesh& mesh : meshes()) {
        const auto bytes = written(mesh);
        const auto triangles = read_connectivity_bitstream(bytes, mesh.vertex_count, kAnyTriangleCount);
        ASSERT_TRUE(triangles) << mesh.name << ": " << triangles.error().to_string();
        EXPECT_EQ(*triangles, mesh.triangles) << mesh.name;
        EXPECT_EQ(written({mesh.name, mesh.vertex_count, *triangles}), bytes) << mesh.name;
    }
}

TEST(ConnectivityBitstream, HasTheLayoutOfTheFormat) {
    const auto bytes = written({"", 300, {{0, 1, 2}, {0, 2, 3}}});
    ByteReader reader(bytes);
    EXPECT_EQ(reader.get<std::uint32_t>(), 0x4d4e4542u);  // BENM
    EXPECT_EQ(reader.get<std::uint8_t>(), 1);             // version
    EXPECT_EQ(reader.get<std::uint8_t>(), 1);             // coder
    EXPECT_EQ(reader.get_varint(1000), 300u);
    EXPECT_EQ(reader.get_varint(1000), 2u);
    const auto size = reader.get_varint(1000);
    ASSERT_TRUE(size);
    ASSERT_EQ(reader.remaining(), *size + 4);
    ASSERT_TRUE(reader.get_bytes(*size));
    EXPECT_EQ(reader.get<std::uint32_t>(), crc32c(std::span(bytes).first(bytes.size() - 4)));
}

TEST(ConnectivityBitstream, NamesTheTriangleOfAnIndexOutOfRange) {
    const std::vector<Triangle> triangles = {{0, 1, 2}, {0, 2, 3}};
    const auto result = write_connectivity_bitstream(triangles, 3);
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().code, ErrorCode::kOutOfRange);
    EXPECT_NE(result.error().message.find("triangle 1"), std::string::npos);
}

TEST(ConnectivityBitstream, RejectsEveryTruncation) {
    for (const Mesh& mesh : meshes()) {
        const auto bytes = written(mesh);
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
    for (const Mesh& mesh : meshes()) {
        auto bytes = written(mesh);
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
    auto bytes = written(meshes()[3]);
    bytes[3] = 'X';
    EXPECT_EQ(error_of(bytes, 4), ErrorCode::kFormat);
    EXPECT_EQ(error_of({}, 4), ErrorCode::kFormat);
}

TEST(ConnectivityBitstream, RejectsFutureVersionAndCoder) {
    auto bytes = written(meshes()[3]);
    bytes[4] = 2;
    EXPECT_EQ(error_of(bytes, 4), ErrorCode::kUnsupported);
    EXPECT_EQ(error_of(sealed(header(2, 4, 0, 0)), 4), ErrorCode::kUnsupported);
}

TEST(ConnectivityBitstream, RejectsEveryFlippedBit) {
    for (const Mesh& mesh : meshes()) {
        const auto bytes = written(mesh);
        for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
            auto flipped = bytes;
            flipped[bit / 8] ^= static_cast<std::uint8_t>(1u << (bit % 8));
            ASSERT_NE(error_of(flipped, mesh.vertex_count), ErrorCode{}) << mesh.name << " bit " << bit;
        }
    }
}

TEST(ConnectivityBitstream, RejectsAnotherVertexCount) {
    const auto bytes = written(meshes()[3]);
    EXPECT_EQ(error_of(bytes, 5), ErrorCode::kCorrupt);
    EXPECT_EQ(error_of(bytes, -1), ErrorCode::kCorrupt);
}

TEST(ConnectivityBitstream, RejectsImpossibleCountsBeforeAllocating) {
    constexpr std::uint64_t kMost = (std::uint64_t{1} << 63) - 1;
    for (const std::uint64_t triangle_count : {std::uint64_t{1}, std::uint64_t{1} << 40, kMost}) {
        EXPECT_EQ(error_of(sealed(header(1, 4, triangle_count, 0)), 4), ErrorCode::kCorrupt);
    }
    EXPECT_EQ(error_of(sealed(header(1, std::uint64_t{1} << 31, 0, 0)), std::int64_t{1} << 31),
              ErrorCode::kCorrupt);
    EXPECT_EQ(error_of(sealed(header(1, 4, 0, kMost)), 4), ErrorCode::kCorrupt);
}

// Damage that an attacker sealed again: any answer but a crash, and never an index out of range.
TEST(ConnectivityBitstream, SurvivesDamageUnderAMatchingChecksum) {
    for (const Mesh& mesh : meshes()) {
        const auto bytes = written(mesh);
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
    const auto written = write_connectivity_bitstream(triangles, 3);
    ASSERT_TRUE(written);
    EXPECT_TRUE(read_connectivity_bitstream(written->bytes, 3, 1000));
    const auto refused = read_connectivity_bitstream(written->bytes, 3, 999);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::kCorrupt);
}

}  // namespace
}  // namespace batchenc
