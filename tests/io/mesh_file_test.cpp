#include "io/mesh/mesh_file.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>

#include "hdf5_test_file.h"

namespace batchenc {
namespace {

using testing::TemporaryFolder;

Expected<Mesh> read(const std::string& extension, const std::string& bytes) {
    const TemporaryFolder folder;
    const auto path = folder / ("mesh" + extension);
    testing::write_bytes(path, bytes);
    return read_mesh(path);
}

/// A square as two triangles or as one polygon, and a vertex without a face.
const std::vector<float> kPlaces = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0.5f, 9, 9, 9};
const std::vector<Triangle> kTriangles = {{0, 1, 2}, {0, 2, 3}};

void expect_square(const Expected<Mesh>& mesh, const std::string& what) {
    ASSERT_TRUE(mesh) << what << ": " << mesh.error().to_string();
    EXPECT_EQ(mesh->positions, kPlaces) << what;
    EXPECT_EQ(mesh->triangles, kTriangles) << what;
    EXPECT_EQ(mesh->polygon_count, 1) << what;
}

const std::string kObj =
    "# a square\r\nmtllib x.mtl\no square\nv 0 0 0\nv 1 0 0 0.5 0.5 0.5\nv 1.0e0 +1 0\n  v 0 1 0.5 # "
    "lifted\nv 9 9 9\n"
    "vt 0 0\nvn 0 0 1\ng a\ns off\nf 1/1/1 2//1 \\\n 3/1 -2\nl 1 2\n";
const std::string kOff = "OFF # a square\n5 1 0\n\n0 0 0\n1 0 0\n1 1 0\n0 1 0.5\n9 9 9\n4 0 1 2 3 255 0 0\n";
const std::string kPlyHeader =
    "element vertex 5\nproperty float x\nproperty uchar red\nproperty float y\nproperty float z\n"
    "element edge 1\nproperty int vertex1\nproperty list uchar short extra\nelement face 1\nproperty uchar "
    "flags\n"
    "property list uchar int vertex_indices\nend_header\n";
const std::string kAsciiPly = "ply\nformat ascii 1.0\ncomment C:\\\n" + kPlyHeader +
                              "0 7 0 0\n1 7 0 0\n1 7 1 0\n0 7 1 0.5\n9 7 9 9\n3 2 8 9\n1 4 0 1 2 3\n";

std::string binary_ply(bool big) {
    std::string bytes =
        std::string("ply\nformat binary_") + (big ? "big" : "little") + "_endian 1.0\n" + kPlyHeader;
    const auto put = [&](auto value) {
        std::string raw(sizeof(value), '\0');
        std::memcpy(raw.data(), &value, sizeof(value));
        if (big) std::reverse(raw.begin(), raw.end());
        bytes += raw;
    };
    for (std::size_t v = 0; v < 5; ++v) {
        put(kPlaces[3 * v]);
        put(std::uint8_t{7});
        put(kPlaces[3 * v + 1]);
        put(kPlaces[3 * v + 2]);
    }
    put(std::int32_t{3});
    put(std::uint8_t{2});
    put(std::int16_t{8});
    put(std::int16_t{9});
    put(std::uint8_t{1});
    put(std::uint8_t{4});
    for (const std::int32_t corner : {0, 1, 2, 3}) put(corner);
    return bytes;
}

TEST(MeshFile, ReadsEveryFormat) {
    expect_square(read(".obj", kObj), "obj");
    EXPECT_EQ(read(".obj", "v 0 0 0\nf 1\nf 1 1\n")->ignored_count, 2);
    expect_square(read(".off", kOff), "off");
    expect_square(read(".off", "OFF 5 1 0\n" + kOff.substr(kOff.find("0 0 0\n"))), "off, counts beside OFF");
    expect_square(read(".off", "C" + kOff), "coff");
    expect_square(read(".ply", kAsciiPly), "ascii");
    expect_square(read(".ply", binary_ply(false)), "little");
    expect_square(read(".ply", binary_ply(true)), "big");
}

TEST(MeshFile, RefusesWithThePlace) {
    const auto expect = [](const std::string& extension, const std::string& bytes, ErrorCode code,
                           const std::string& words) {
        const auto mesh = read(extension, bytes);
        ASSERT_FALSE(mesh) << bytes;
        EXPECT_EQ(mesh.error().code, code) << mesh.error().to_string();
        EXPECT_NE(mesh.error().to_string().find(words), std::string::npos) << mesh.error().to_string();
    };
    using enum ErrorCode;
    expect(".obj", "v 0 0 0\nv 1 0\n", kFormat, "mesh.obj:2: ");
    expect(".obj", "v 0 0 0\nv 1 0 zero\n", kFormat, "mesh.obj:2: ");
    expect(".obj", "v 0 0 0\n\nv 1 nan 0\n", kNotFinite, "mesh.obj:3: ");
    expect(".obj", "v 0 0 1e39\n", kNotFinite, "mesh.obj:1: ");
    expect(".obj", "v 0 0 -1e999\n", kNotFinite, "mesh.obj:1: ");
    expect(".obj", "v 0 0 0\nf 1 1 2\nv 0 0 0\nf 1 2 3\n", kOutOfRange, "mesh.obj:4: ");
    expect(".obj", "v 0 0 0\nf 1 1 0\n", kFormat, "mesh.obj:2: ");
    expect(".obj", "v 0 0 0\nf 1 1 -2\n", kOutOfRange, "mesh.obj:2: ");
    expect(".obj", "v 0 0 0\nf 1 1 99999999999999999999\n", kFormat, "mesh.obj:2: ");
    expect(".obj", "f 1 2 3\n", kFormat, "no vertices");
    expect(".obj", "", kFormat, "no vertices");
    expect(".off", "FOO\n", kFormat, "OFF");
    expect(".off", "OFF\n9999999999 1 0\n0 0 0\n", kFormat, "vertex 1 of 9999999999");
    expect(".off", "OFF\n1 1 0\n0 0 0\n3 0 0 1\n", kOutOfRange, "mesh.off:4: ");
    expect(".off", "OFF\n1 1 0\n0 0 0\n3 0 0 -1\n", kOutOfRange, "mesh.off:4: ");
    expect(".off", "OFF\n1 1 0\n0 0 0\n9999999999 0 0\n", kFormat, "face 0 of 1");
    expect(".ply", "plx\n", kFormat, "ply");
    expect(".ply", "ply\nelement vertex 1\nend_header\n", kFormat, "format");
    const std::string vertex = "element vertex 1\n", x = "property float x\n", y = "property float y\n",
                      z = "property float z\n", end = "end_header\n", ascii = "ply\nformat ascii 1.0\n";
    expect(".ply", ascii + "element vertex 1000000000000\n" + end, kFormat, "one z");
    expect(".ply", ascii + vertex + x + end + "0\n", kFormat, "one z");
    expect(".ply", ascii + vertex + x + x + y + end + "0 0 0\n", kFormat, "one z");
    expect(".ply", ascii + vertex + x + y + z + x + end + "0 0 0 0\n", kFormat, "one x");
    expect(".ply", ascii + vertex + "property list uchar float x\n" + y + z + end + "1 0 0 0\n", kFormat,
           "one x");
    expect(".ply", ascii + vertex + x + y + z + vertex + x + y + z + end + "0 0 0\n0 0 0\n", kFormat,
           "two elements");
    const std::string head = ascii + vertex + x + y + z + "element face 2\n",
                      list = "property list uchar int vertex_index\n";
    expect(".ply", head + "property list uchar int others\n" + end + "0 0 0\n1 0\n1 0\n", kFormat,
           "vertex_indices");
    expect(".ply", head + list + list + end + "0 0 0\n1 0 1 0\n1 0 1 0\n", kFormat, "vertex_indices");
    expect(".ply", head + list + end + "0 0 0\n3 0 0 0\n3 0 0 1\n", kOutOfRange,
           "face 1 names vertex 1, counted from 0, of 1");
    expect(".ply", head + list + end + "0 0 0\n3 0 0 0\n3 0 0 -1\n", kOutOfRange, "face 1 names vertex -1");
    expect(".ply", head + list + end + "0 0 0\n3 0 0 0\n3 0 0 0.5\n", kFormat, "face 1 of 2");
    expect(".ply", head + list + end + "0 0 0\n-1\n", kFormat, "face 0 of 2");
    expect(".ply", ascii + vertex + x + y + "property double z\n" + end + "0 0 1e39\n", kNotFinite,
           "vertex 0");
    expect(".ply", "ply\nformat ascii 1.0\nproperty float x\nend_header\n", kFormat, "mesh.ply:3: ");
    expect(".ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty quad x\nend_header\n", kFormat,
           "mesh.ply:4: ");
    expect(".stl", "solid\n", kUnsupported, ".obj, .off or .ply");
    EXPECT_EQ(read_mesh("nowhere.obj").error().code, kIo);
}

TEST(MeshFile, RefusesWhatNoClipCanHave) {
    const TemporaryFolder folder;
    testing::write_bytes(folder / "mesh.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 2 3 1\n");
    SourceLimits limits{.max_vertices = 3, .max_frames = 1, .max_triangles = 3};
    EXPECT_TRUE(read_mesh(folder / "mesh.obj", limits));
    limits.max_triangles = 2;
    EXPECT_EQ(read_mesh(folder / "mesh.obj", limits).error().code, ErrorCode::kLimit);
    limits = {.max_vertices = 2, .max_frames = 1, .max_triangles = 3};
    EXPECT_EQ(read_mesh(folder / "mesh.obj", limits).error().code, ErrorCode::kLimit);
}

TEST(MeshFile, RoundsToTheNearestFloat) {
    // By way of double it would be the neighbour: the decimal is next to the middle between two.
    const std::string word = "7.038531e-26";
    for (const auto& [extension, bytes] :
         {std::pair<std::string, std::string>{".obj", "v " + word + " 1e-400 -1e-9999999999999999999999\n"},
          {".off", "OFF\n1 0 0\n" + word + " 0." + std::string(400, '0') + "1 -0e99999\n"},
          {".ply",
           "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty double y\nproperty "
           "float z\nend_header\n" +
               word + " 1e-400 -1e-50\n"}}) {
        const auto mesh = read(extension, bytes);
        ASSERT_TRUE(mesh) << mesh.error().to_string();
        EXPECT_EQ(mesh->positions, (std::vector<float>{7.038531e-26f, 0.0f, -0.0f})) << extension;
        EXPECT_TRUE(std::signbit(mesh->positions[2])) << extension;
    }
    for (const char* large : {"1e400", "1e9999999999999999999999", "0.01e42",
                              "34028236000000000000000000000000"
                              "00000000"}) {
        const auto mesh = read(".obj", std::string("v 0 0 ") + large + "\n");
        ASSERT_FALSE(mesh) << large;
        EXPECT_EQ(mesh.error().code, ErrorCode::kNotFinite) << large;
    }
    EXPECT_EQ(read(".obj", "v 0 0 +-1\n").error().code, ErrorCode::kFormat);
}

TEST(MeshFile, ReadsCoordinatesOfAnyType) {
    const auto head = [](const char* format) {
        return std::string("ply\nformat ") + format +
               " 1.0\nelement vertex 1\nproperty uint32 x\nproperty short y\nproperty char z\nelement face "
               "1\nproperty list int8 uint8 vertex_indices\nend_header\n";
    };
    const auto expect = [](const Expected<Mesh>& mesh) {
        ASSERT_TRUE(mesh) << mesh.error().to_string();
        EXPECT_EQ(mesh->positions, (std::vector<float>{4278190080.0f, -2, -128}));
        EXPECT_EQ(mesh->triangles, (std::vector<Triangle>{{0, 0, 0}}));
    };
    expect(read(".ply", head("ascii") + "4278190080 -2 -128 3 0 0 0\n"));
    expect(read(".ply",
                head("binary_big_endian") + std::string("\xff\x00\x00\x00\xff\xfe\x80\x03\x00\x00\x00", 11)));
    expect(read(".ply", head("binary_little_endian") +
                            std::string("\x00\x00\x00\xff\xfe\xff\x80\x03\x00\x00\x00", 11)));
    // A list of negative size.
    EXPECT_FALSE(read(
        ".ply", head("binary_big_endian") + std::string("\xff\x00\x00\x00\xff\xfe\x80\xff\x00\x00\x00", 11)));
}

TEST(MeshFile, ReadsExtensionsInCapitals) { expect_square(read(".OBJ", kObj), "capitals"); }

TEST(MeshFile, SurvivesEveryTruncationAndFlippedByte) {
    const std::pair<std::string, std::string> files[] = {{".obj", kObj},
                                                         {".off", kOff},
                                                         {".ply", kAsciiPly},
                                                         {".ply", binary_ply(false)},
                                                         {".ply", binary_ply(true)}};
    const auto look = [](const Expected<Mesh>& mesh) {
        if (!mesh) return;
        for (const float value : mesh->positions) EXPECT_TRUE(std::isfinite(value));
        for (const Triangle& t : mesh->triangles) {
            for (const std::int32_t v : t) EXPECT_TRUE(v >= 0 && v < mesh->vertex_count());
        }
    };
    for (const auto& [extension, bytes] : files) {
        for (std::size_t size = 0; size < bytes.size(); ++size) {
            const auto mesh = read(extension, bytes.substr(0, size));
            look(mesh);
            if (bytes.find("binary") != std::string::npos) {
                EXPECT_FALSE(mesh) << extension << " " << size;
            }
        }
        for (std::size_t at = 0; at < bytes.size(); ++at) {
            for (const char change : {'\x01', '\x10', '\x80', '\xff'}) {
                std::string changed = bytes;
                changed[at] = static_cast<char>(changed[at] ^ change);
                look(read(extension, changed));
            }
        }
    }
}

TEST(MeshFile, WritesColoursInBothEncodings) {
    const TemporaryFolder folder;
    const std::vector<float> places = {0.1f, 2, 3, 4, 5, 6, 7, 8, -9};
    const std::vector<Triangle> triangles = {{2, 0, 1}};
    const std::vector<Color> colors = {{1, 2, 3}, {255, 0, 7}, {9, 9, 9}};
    for (const auto encoding : {PlyEncoding::kBinary, PlyEncoding::kAscii}) {
        ASSERT_TRUE(write_mesh(folder / "a.ply", {places.data(), 1, 3}, triangles, colors, true, encoding));
        const auto mesh = read_mesh(folder / "a.ply");
        ASSERT_TRUE(mesh) << mesh.error().to_string();
        EXPECT_EQ(mesh->positions, places);
        EXPECT_EQ(mesh->triangles, triangles);
    }
    std::ifstream file(folder / "a.ply");
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    EXPECT_TRUE(text.ends_with("\n0.1 2 3 1 2 3\n4 5 6 255 0 7\n7 8 -9 9 9 9\n3 2 0 1\n")) << text;
}

TEST(MeshFile, WritesWhatItReads) {
    const TemporaryFolder folder;
    std::vector<float> places = {0.1f,  -1e-30f, 3.4e38f, 1.0f / 3.0f,  16777216.0f,
                                 -0.0f, 1e-44f,  2.5f,    7.038531e-26f};
    const std::vector<Triangle> triangles = {{2, 0, 1}, {1, 1, 0}};
    const std::pair<const char*, PlyEncoding> files[] = {{"a.obj", PlyEncoding::kBinary},
                                                         {"a.off", PlyEncoding::kBinary},
                                                         {"a.ply", PlyEncoding::kBinary},
                                                         {"text.ply", PlyEncoding::kAscii}};
    for (const auto& [name, encoding] : files) {
        const auto path = folder / name;
        ASSERT_TRUE(write_mesh(path, {places.data(), 1, 3}, triangles, {}, false, encoding)) << name;
        const auto mesh = read_mesh(path);
        ASSERT_TRUE(mesh) << mesh.error().to_string();
        ASSERT_EQ(mesh->positions.size(), places.size());
        for (std::size_t k = 0; k < places.size(); ++k)
            EXPECT_EQ(std::bit_cast<std::uint32_t>(mesh->positions[k]),
                      std::bit_cast<std::uint32_t>(places[k]))
                << name << " " << k;
        EXPECT_EQ(mesh->triangles, triangles) << name;
        EXPECT_EQ(write_mesh(path, {places.data(), 1, 3}, triangles, {}, false).error().code,
                  ErrorCode::kExists);
        EXPECT_TRUE(write_mesh(path, {places.data(), 1, 3}, {}, {}, true));
        EXPECT_TRUE(read_mesh(path)->triangles.empty());
    }
    EXPECT_EQ(write_mesh(folder / "a.stl", {places.data(), 1, 3}, {}, {}, false).error().code,
              ErrorCode::kUnsupported);
    EXPECT_EQ(folder.file_count(), 4u);
}

}  // namespace
}  // namespace batchenc
