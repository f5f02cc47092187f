#include "io/ply_file.h"

#include <bit>
#include <cstring>
#include <fstream>
#include <string>
#include <vector>

#include "io/hdf5/durable_file.h"

namespace batchenc {

namespace {

static_assert(std::endian::native == std::endian::little, "values are written as they stand in memory");

std::string header(std::int64_t vertex_count, std::size_t triangle_count, bool colored) {
    std::string text = "ply\nformat binary_little_endian 1.0\ncomment batchenc\nelement vertex " +
                       std::to_string(vertex_count) +
                       "\nproperty float x\nproperty float y\nproperty float z\n";
    if (colored) text += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
    return text + "element face " + std::to_string(triangle_count) +
           "\nproperty list uchar int vertex_indices\nend_header\n";
}

template <typename Value>
void append(std::vector<char>& bytes, const Value& value) {
    const std::size_t at = bytes.size();
    bytes.resize(at + sizeof(value));
    std::memcpy(bytes.data() + at, &value, sizeof(value));
}

}  // namespace

Expected<void> write_ply(const std::filesystem::path& path, PositionsView positions,
                         std::span<const Triangle> triangles, std::span<const Color> colors, bool overwrite) {
    auto target = DurableFile::create(path, overwrite);
    if (!target) return tl::unexpected(target.error());
    std::vector<char> bytes;
    for (std::int64_t v = 0; v < positions.vertex_count(); ++v) {
        for (int axis = 0; axis < 3; ++axis) append(bytes, positions.at(0, v)[axis]);
        if (!colors.empty()) append(bytes, colors[static_cast<std::size_t>(v)]);
    }
    for (const Triangle& t : triangles) {
        append(bytes, std::uint8_t{3});
        append(bytes, t);
    }
    std::ofstream file(target->temporary_path(), std::ios::binary);
    file << header(positions.vertex_count(), triangles.size(), !colors.empty());
    file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    file.close();
    if (!file) return fail(ErrorCode::kIo, "cannot be written", path.string());
    return target->commit();
}

}  // namespace batchenc
