#include "kernels/byte_stream.h"

#include <gtest/gtest.h>

#include <limits>

namespace batchenc {
namespace {

constexpr std::uint64_t kNoLimit = std::numeric_limits<std::uint64_t>::max();

TEST(ByteStream, RoundTripsEveryType) {
    ByteWriter writer;
    writer.put<std::uint8_t>(0xab);
    writer.put<std::int32_t>(-5);
    writer.put<float>(1.5f);
    writer.put<double>(-2.25);
    writer.put_varint(300);
    const std::vector<std::uint8_t> tail = {1, 2, 3};
    writer.put_bytes(tail);
    ASSERT_EQ(writer.size(), 1u + 4 + 4 + 8 + 2 + 3);

    const auto bytes = writer.take();
    ByteReader reader(bytes);
    EXPECT_EQ(reader.get<std::uint8_t>(), 0xab);
    EXPECT_EQ(reader.get<std::int32_t>(), -5);
    EXPECT_EQ(reader.get<float>(), 1.5f);
    EXPECT_EQ(reader.get<double>(), -2.25);
    EXPECT_EQ(reader.get_varint(kNoLimit), 300u);
    const auto read = reader.get_bytes(3);
    ASSERT_TRUE(read);
    EXPECT_TRUE(std::equal(read->begin(), read->end(), tail.begin(), tail.end()));
    EXPECT_EQ(reader.remaining(), 0u);
    EXPECT_EQ(reader.position(), bytes.size());
}

TEST(ByteStream, IsLittleEndian) {
    ByteWriter writer;
    writer.put<std::uint32_t>(0x04030201);
    writer.put_varint(0x80);
    EXPECT_EQ(writer.bytes(), (std::vector<std::uint8_t>{1, 2, 3, 4, 0x80, 0x01}));
}

TEST(ByteStream, RoundTripsVarintsOfEveryLength) {
    for (int bits = 0; bits <= 64; ++bits) {
        const std::uint64_t top = bits == 0 ? 0 : std::uint64_t{1} << (bits - 1);
        for (const std::uint64_t value : {top, top - 1, top + 1, top | (top >> 1)}) {
            ByteWriter writer;
            writer.put_varint(value);
            ByteReader reader(writer.bytes());
            ASSERT_EQ(reader.get_varint(kNoLimit), value);
            ASSERT_EQ(reader.remaining(), 0u);
            // every shorter stream is refused, and the reader stays where it was
            for (std::size_t size = 0; size < writer.size(); ++size) {
                const std::vector<std::uint8_t> cut(writer.bytes().begin(), writer.bytes().begin() + size);
                ByteReader short_reader(cut);
                const auto result = short_reader.get_varint(kNoLimit);
                ASSERT_FALSE(result);
                ASSERT_EQ(result.error().code, ErrorCode::kCorrupt);
                ASSERT_EQ(short_reader.position(), 0u);
            }
        }
    }
}

TEST(ByteStream, RefusesVarintsAboveTheirLimit) {
    ByteWriter writer;
    writer.put_varint(1000);
    EXPECT_EQ(ByteReader(writer.bytes()).get_varint(1000), 1000u);
    const auto result = ByteReader(writer.bytes()).get_varint(999);
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().code, ErrorCode::kCorrupt);
    EXPECT_NE(result.error().message.find("1000"), std::string::npos);
}

TEST(ByteStream, RefusesVarintsWithASecondSpelling) {
    const std::vector<std::vector<std::uint8_t>> padded = {
        {0x80, 0x00}, {0xff, 0x80, 0x00}, {0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x00}};
    for (const auto& bytes : padded) EXPECT_FALSE(ByteReader(bytes).get_varint(kNoLimit));
    const std::vector<std::uint8_t> too_long(11, 0x80);
    EXPECT_FALSE(ByteReader(too_long).get_varint(kNoLimit));
    const std::vector<std::uint8_t> bit_65 = {0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0x02};
    EXPECT_FALSE(ByteReader(bit_65).get_varint(kNoLimit));
}

TEST(ByteStream, NeverReadsBeyondTheEnd) {
    const std::vector<std::uint8_t> bytes = {1, 2, 3};
    ByteReader reader(bytes);
    const auto word = reader.get<std::uint32_t>();
    ASSERT_FALSE(word);
    EXPECT_EQ(word.error().code, ErrorCode::kCorrupt);
    EXPECT_EQ(reader.position(), 0u);
    EXPECT_FALSE(reader.get_bytes(4));
    EXPECT_FALSE(reader.get_bytes(kNoLimit));
    EXPECT_EQ(reader.position(), 0u);
    EXPECT_TRUE(reader.get_bytes(3));
    EXPECT_TRUE(reader.get_bytes(0));
    EXPECT_FALSE(reader.get<std::uint8_t>());
}

}  // namespace
}  // namespace batchenc
