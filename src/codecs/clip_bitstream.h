#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/parameters.h"

namespace batchenc {

// The container of every coded clip (docs/FORMAT.md): magic, version, method, counts, a table of sections,
// each section with its own CRC32C. What stands in the sections is the coder's business.

/// Sections in the order in which they are written; the numbers stand in bitstreams.
enum class SectionId : std::uint8_t {
    kParameters = 1,
    kSegmentation = 2,
    kFrames = 3,
    kBasis = 4,
    kCoefficients = 5,
    kResiduals = 6
};
inline constexpr std::size_t kSectionCount = 6;

/// Name for messages, such as "basis".
const char* section_name(SectionId id);

using SectionPayload = std::pair<SectionId, std::vector<std::uint8_t>>;

/// A clip's bitstream from its sections, which stand in ascending order of their numbers.
std::vector<std::uint8_t> write_clip_bitstream(CodecMethod method, std::int64_t vertex_count,
                                               std::int64_t frame_count,
                                               std::span<const SectionPayload> sections);

/// A bitstream taken apart; the payloads point into it.
struct ClipBitstream {
    CodecMethod method = CodecMethod::kRlpca;
    std::int64_t vertex_count = 0;
    std::int64_t frame_count = 0;
    std::array<std::span<const std::uint8_t>, kSectionCount> payloads;  ///< empty where a section is absent

    std::span<const std::uint8_t> payload(SectionId id) const {
        return payloads[static_cast<std::size_t>(id) - 1];
    }
};

/// Checks magic, version, counts, sizes and every checksum; nothing is allocated.
/// Errors: kFormat, kUnsupported, kCorrupt, with the section in `where`.
Expected<ClipBitstream> parse_clip_bitstream(std::span<const std::uint8_t> bitstream);

}  // namespace batchenc
