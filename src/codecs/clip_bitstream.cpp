#include "codecs/clip_bitstream.h"

#include <algorithm>

#include "kernels/byte_stream.h"
#include "kernels/crc32c.h"

namespace batchenc {
namespace {

constexpr std::array<std::uint8_t, 4> kMagic = {'B', 'E', 'N', 'C'};
constexpr std::uint8_t kVersion = 1;
constexpr std::uint64_t kMaxVertices = (std::uint64_t{1} << 31) - 1;
constexpr std::uint64_t kMaxFrames = (std::uint64_t{1} << 31) - 1;

bool is_method(std::uint8_t value) {
    const auto method = static_cast<CodecMethod>(value);
    return method != CodecMethod::kAuto && is_available(method);
}

}  // namespace

const char* section_name(SectionId id) {
    switch (id) {
        case SectionId::kParameters:
            return "section parameters";
        case SectionId::kSegmentation:
            return "section segmentation";
        case SectionId::kFrames:
            return "section frames";
        case SectionId::kBasis:
            return "section basis";
        case SectionId::kCoefficients:
            return "section coefficients";
        case SectionId::kResiduals:
            return "section residuals";
    }
    return "unknown section";
}

std::vector<std::uint8_t> write_clip_bitstream(CodecMethod method, std::int64_t vertex_count,
                                               std::int64_t frame_count,
                                               std::span<const SectionPayload> sections) {
    ByteWriter out;
    out.put_bytes(kMagic);
    out.put(kVersion);
    out.put(static_cast<std::uint8_t>(method));
    out.put_varint(static_cast<std::uint64_t>(vertex_count));
    out.put_varint(static_cast<std::uint64_t>(frame_count));
    out.put_varint(sections.size());
    for (const auto& [id, payload] : sections) {
        out.put(static_cast<std::uint8_t>(id));
        out.put_varint(payload.size());
    }
    out.put(crc32c(out.bytes()));
    for (const auto& [id, payload] : sections) {
        out.put_bytes(payload);
        out.put(crc32c(payload));
    }
    return out.take();
}

Expected<ClipBitstream> parse_clip_bitstream(std::span<const std::uint8_t> bitstream) {
    const auto at = [](const char* where) {
        return [where](Error error) { return fail_within(where, std::move(error)).value(); };
    };
    const auto in_header = at("clip header");
    ByteReader reader(bitstream);
    const auto magic = reader.get_bytes(kMagic.size());
    if (!magic || !std::equal(kMagic.begin(), kMagic.end(), magic->begin())) {
        return fail(ErrorCode::kFormat, "no clip bitstream: the magic number is missing", "clip header");
    }
    const auto version = reader.get<std::uint8_t>().map_error(in_header);
    if (!version) return tl::unexpected(version.error());
    if (*version != kVersion) {
        return fail(ErrorCode::kUnsupported,
                    "bitstream version " + std::to_string(*version) + "; this program reads version 1",
                    "clip header");
    }
    ClipBitstream clip;
    const auto method = reader.get<std::uint8_t>().map_error(in_header);
    const auto vertices = reader.get_varint(kMaxVertices).map_error(in_header);
    if (!vertices) return tl::unexpected(vertices.error());
    const auto frames = reader.get_varint(kMaxFrames).map_error(in_header);
    if (!frames) return tl::unexpected(frames.error());
    const auto count = reader.get_varint(kSectionCount).map_error(in_header);
    if (!count) return tl::unexpected(count.error());
    if (!is_method(*method))
        return fail(ErrorCode::kUnsupported, "coder number " + std::to_string(*method) + " is unknown",
                    "clip header");
    clip.method = static_cast<CodecMethod>(*method);
    clip.vertex_count = static_cast<std::int64_t>(*vertices);
    clip.frame_count = static_cast<std::int64_t>(*frames);

    std::array<std::uint64_t, kSectionCount> sizes{};
    std::array<bool, kSectionCount> present{};
    std::uint8_t last = 0;
    for (std::uint64_t i = 0; i < *count; ++i) {
        const auto id = reader.get<std::uint8_t>().map_error(in_header);
        if (!id) return tl::unexpected(id.error());
        const auto size = reader.get_varint(bitstream.size()).map_error(in_header);
        if (!size) return tl::unexpected(size.error());
        if (*id <= last || *id > kSectionCount)
            return fail(ErrorCode::kCorrupt, "sections are out of order", "clip header");
        last = *id;
        sizes[*id - 1u] = *size;
        present[*id - 1u] = true;
    }
    const std::uint32_t header_crc = crc32c(bitstream.first(reader.position()));
    const auto stored_crc = reader.get<std::uint32_t>().map_error(in_header);
    if (!stored_crc) return tl::unexpected(stored_crc.error());
    if (*stored_crc != header_crc) return fail(ErrorCode::kCorrupt, "checksum does not match", "clip header");
    if (clip.vertex_count == 0 || clip.frame_count == 0)
        return fail(ErrorCode::kCorrupt, "a clip without vertices or frames", "clip header");

    for (std::size_t i = 0; i < kSectionCount; ++i) {
        if (!present[i]) continue;
        const auto in_section = at(section_name(static_cast<SectionId>(i + 1)));
        const auto payload = reader.get_bytes(sizes[i]).map_error(in_section);
        if (!payload) return tl::unexpected(payload.error());
        const auto crc = reader.get<std::uint32_t>().map_error(in_section);
        if (!crc) return tl::unexpected(crc.error());
        if (*crc != crc32c(*payload))
            return fail(ErrorCode::kCorrupt, "checksum does not match",
                        section_name(static_cast<SectionId>(i + 1)));
        clip.payloads[i] = *payload;
    }
    if (reader.remaining() != 0)
        return fail(ErrorCode::kCorrupt, std::to_string(reader.remaining()) + " bytes after the last section",
                    "clip header");
    return clip;
}

}  // namespace batchenc
