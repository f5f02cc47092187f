#include <gtest/gtest.h>
#include <libdeflate.h>

#include <cmath>
#include <limits>

#include "io/source_clip.h"
#include "tests/io/hdf5_test_file.h"
#include "tests/io/source_clip_reading.h"

namespace batchenc {
namespace {

using testing::HandmadeFile;
using testing::part_of;
using testing::read_range;
using testing::TemporaryFolder;

constexpr std::int64_t kFrames = 23;
constexpr std::int64_t kVertices = 41;

void expect_open_fails(const std::filesystem::path& path, ErrorCode code, const std::string& words,
                       const SourceNames& names = {}, const SourceLimits& limits = {}) {
    const auto clip = SourceClip::open(path, names, limits);
    ASSERT_FALSE(clip) << "opened although " << words;
    EXPECT_EQ(clip.error().code, code) << clip.error().to_string();
    EXPECT_NE(clip.error().to_string().find(words), std::string::npos) << clip.error().to_string();
    EXPECT_NE(clip.error().where.find(path.string()), std::string::npos) << clip.error().to_string();
}

TEST(SourceRefusals, RefusesWhatIsNoHdf5File) {
    const TemporaryFolder folder;
    expect_open_fails(folder / "missing.h5", ErrorCode::kIo, "No such file");
    expect_open_fails(folder / ".", ErrorCode::kIo, "not a regular file");
    testing::write_bytes(folder / "empty.h5", "");
    expect_open_fails(folder / "empty.h5", ErrorCode::kFormat, "not an HDF5 file");
    testing::write_bytes(folder / "text.h5", std::string(4000, 'x'));
    expect_open_fails(folder / "text.h5", ErrorCode::kFormat, "not an HDF5 file");
    { HandmadeFile(folder / "cut.h5").add_positions(testing::smooth_positions(9, 99), 9, 99); }
    const std::string bytes = testing::read_bytes(folder / "cut.h5");
    testing::write_bytes(folder / "cut.h5", bytes.substr(0, bytes.size() - 100));
    expect_open_fails(folder / "cut.h5", ErrorCode::kCorrupt, "damaged");
}

TEST(SourceRefusals, RefusesWrongLayouts) {
    const TemporaryFolder folder;
    const auto path = folder / "clip.h5";
    const auto values = testing::smooth_positions(8, 8);
    const auto with = [&](const auto& fill) {
        HandmadeFile file(path);
        fill(file);
    };
    with([](HandmadeFile&) {});
    expect_open_fails(path, ErrorCode::kFormat, "has no dataset /positions");
    with([&](HandmadeFile& f) {
        f.add("positions", H5T_IEEE_F32LE, {4, 6}, H5T_NATIVE_FLOAT, values.data());
    });
    expect_open_fails(path, ErrorCode::kFormat, "2 dimensions instead of 3");
    with([&](HandmadeFile& f) {
        f.add("positions", H5T_IEEE_F32LE, {3, 4, 5}, H5T_NATIVE_FLOAT, values.data());
    });
    expect_open_fails(path, ErrorCode::kFormat, "last dimension of 5");
    with([&](HandmadeFile& f) {
        f.add("positions", H5T_STD_I32LE, {2, 2, 3}, H5T_NATIVE_INT32, values.data());
    });
    expect_open_fails(path, ErrorCode::kFormat, "neither float32 nor float64");
    with([](HandmadeFile& f) { H5Gclose(H5Gcreate2(f.id(), "positions", 0, 0, 0)); });
    expect_open_fails(path, ErrorCode::kFormat, "not a dataset");
    with([](HandmadeFile& f) { f.add("positions", H5T_IEEE_F32LE, {0, 4, 3}, H5T_NATIVE_FLOAT, nullptr); });
    expect_open_fails(path, ErrorCode::kFormat, "no frames");
    with([](HandmadeFile& f) { f.add("positions", H5T_IEEE_F32LE, {4, 0, 3}, H5T_NATIVE_FLOAT, nullptr); });
    expect_open_fails(path, ErrorCode::kFormat, "no vertices");
    with([&](HandmadeFile& f) {
        f.add_positions(values, 8, 8);
        f.add("triangles", H5T_IEEE_F32LE, {2, 3}, H5T_NATIVE_FLOAT, values.data());
    });
    expect_open_fails(path, ErrorCode::kFormat, "neither int32 nor int64");
    with([&](HandmadeFile& f) {
        f.add_positions(values, 8, 8);
        f.add("triangles", H5T_STD_I32LE, {2, 4}, H5T_NATIVE_INT32, values.data());
    });
    expect_open_fails(path, ErrorCode::kFormat, "last dimension of 4");
    with([&](HandmadeFile& f) { f.add_positions(values, 8, 8); });
    EXPECT_TRUE(SourceClip::open(path));
    expect_open_fails(path, ErrorCode::kFormat, "has no dataset /faces", {"/positions", "/faces"});
    expect_open_fails(path, ErrorCode::kLimit, "8 frames", {}, {8, 7, 0});
    expect_open_fails(path, ErrorCode::kLimit, "8 vertices", {}, {7, 8, 0});
    EXPECT_TRUE(SourceClip::open(path, {}, {8, 8, 0}));
}

TEST(SourceRefusals, RefusesLinks) {
    const TemporaryFolder folder;
    const auto values = testing::smooth_positions(3, 4);
    { HandmadeFile(folder / "secret.h5").add_positions(values, 3, 4); }
    const auto path = folder / "clip.h5";
    {
        HandmadeFile file(path);
        H5Lcreate_external((folder / "secret.h5").c_str(), "/positions", file.id(), "positions", H5P_DEFAULT,
                           H5P_DEFAULT);
        H5Lcreate_external((folder / "secret.h5").c_str(), "/", file.id(), "group", H5P_DEFAULT, H5P_DEFAULT);
        file.add("real", H5T_IEEE_F32LE, {3, 4, 3}, H5T_NATIVE_FLOAT, values.data());
        H5Lcreate_soft("/real", file.id(), "soft", H5P_DEFAULT, H5P_DEFAULT);
        H5Lcreate_hard(file.id(), "/real", file.id(), "hard", H5P_DEFAULT, H5P_DEFAULT);
    }
    expect_open_fails(path, ErrorCode::kUnsupported, "external link");
    expect_open_fails(path, ErrorCode::kUnsupported, "external link", {"/group/positions", "/triangles"});
    expect_open_fails(path, ErrorCode::kUnsupported, "soft link", {"/soft", "/triangles"});
    expect_open_fails(path, ErrorCode::kUnsupported, "external link", {"/real", "/group/triangles"});
    EXPECT_TRUE(SourceClip::open(path, {"/hard", "/triangles"}));
}

TEST(SourceRefusals, RefusesStorageElsewhere) {
    const TemporaryFolder folder;
    testing::write_bytes(folder / "secret.bin", std::string(4096, 'A'));
    const auto path = folder / "clip.h5";
    {
        HandmadeFile file(path);
        H5Dclose(file.create("positions", H5T_IEEE_F32LE, {3, 4, 3}, {}, [&](hid_t properties) {
            H5Pset_external(properties, (folder / "secret.bin").c_str(), 0, 4096);
        }));
    }
    expect_open_fails(path, ErrorCode::kUnsupported, "other files");

    { HandmadeFile(folder / "secret.h5").add_positions(testing::smooth_positions(3, 4), 3, 4); }
    {
        HandmadeFile file(path);
        H5Dclose(file.create("positions", H5T_IEEE_F32LE, {3, 4, 3}, {}, [&](hid_t properties) {
            const hsize_t shape[3] = {3, 4, 3};
            const hid_t space = H5Screate_simple(3, shape, nullptr);
            H5Pset_virtual(properties, space, (folder / "secret.h5").c_str(), "/positions", space);
            H5Sclose(space);
        }));
    }
    expect_open_fails(path, ErrorCode::kUnsupported, "virtual");
}

std::size_t pass_through(unsigned, std::size_t, const unsigned*, std::size_t size, std::size_t*, void**) {
    return size;
}

TEST(SourceRefusals, RefusesFiltersThatAreNotThere) {
    const TemporaryFolder folder;
    const auto path = folder / "clip.h5";
    const H5Z_class2_t filter = {H5Z_CLASS_T_VERS, 300, 1, 1, "curious", nullptr, nullptr, pass_through};
    ASSERT_GE(H5Zregister(&filter), 0);
    const auto values = testing::smooth_positions(3, 4);
    {
        HandmadeFile file(path);
        file.add("positions", H5T_IEEE_F32LE, {3, 4, 3}, {1, 4, 3}, H5T_NATIVE_FLOAT, values.data(),
                 [](hid_t properties) { H5Pset_filter(properties, 300, 0, 0, nullptr); });
    }
    const auto clip = SourceClip::open(path);  // while it is there, it is used
    ASSERT_TRUE(clip) << clip.error().to_string();
    EXPECT_EQ(read_range(**clip, 0, 3), values);
    const_cast<std::unique_ptr<SourceClip>&>(*clip).reset();
    ASSERT_GE(H5Zunregister(300), 0);
    expect_open_fails(path, ErrorCode::kUnsupported, "filter 300 (curious)");
}

TEST(SourceRefusals, RefusesSizesThatTheFileDoesNotHold) {
    const TemporaryFolder folder;
    const auto path = folder / "clip.h5";
    // Nothing is written: 36 TB by a file of some kilobytes, in each way that HDF5 has.
    const hsize_t frames = 1 << 14;
    const hsize_t vertices = 1 << 27;
    {
        HandmadeFile file(path);
        H5Dclose(file.create("positions", H5T_IEEE_F32LE, {frames, vertices, 3}, {}, [](hid_t) {}));
    }
    expect_open_fails(path, ErrorCode::kCorrupt, "stores only 0");
    {
        HandmadeFile file(path);
        H5Dclose(file.create("positions", H5T_IEEE_F32LE, {frames, vertices, 3}, {1, vertices, 3},
                             [](hid_t properties) { H5Pset_deflate(properties, 1); }));
    }
    expect_open_fails(path, ErrorCode::kFormat, "0 of 16384 chunks were written");
    {
        HandmadeFile file(path);
        H5Dclose(file.create("positions", H5T_IEEE_F64LE, {~hsize_t{0} >> 2, 1 << 20, 3}, {1, 1 << 20, 3},
                             [](hid_t) {}));
    }
    expect_open_fails(path, ErrorCode::kLimit, "larger than any machine");
    {  // a chunk that claims to unpack to 3 MB from 40 bytes
        HandmadeFile file(path);
        const hid_t dataset = file.create("positions", H5T_IEEE_F32LE, {1, 1 << 18, 3}, {1, 1 << 18, 3},
                                          [](hid_t properties) { H5Pset_deflate(properties, 1); });
        const hsize_t corner[3] = {};
        const std::string packed(40, '\1');
        H5Dwrite_chunk(dataset, H5P_DEFAULT, 0, corner, packed.size(), packed.data());
        H5Dclose(dataset);
    }
    expect_open_fails(path, ErrorCode::kCorrupt, "stores only 40");
}

/// A file of two frames in one chunk of 2 × 200 × 3 float32 whose packed bytes are given.
void write_raw_chunk(const std::filesystem::path& path, const std::string& packed,
                     std::uint32_t filter_mask) {
    HandmadeFile file(path);
    const hid_t dataset =
        file.create("positions", H5T_IEEE_F32LE, {2, 200, 3}, {2, 200, 3}, [](hid_t properties) {
            H5Pset_shuffle(properties);
            H5Pset_deflate(properties, 1);
        });
    const hsize_t corner[3] = {};
    H5Dwrite_chunk(dataset, H5P_DEFAULT, filter_mask, corner, packed.size(), packed.data());
    H5Dclose(dataset);
}

/// What HDF5's shuffle filter makes of 4-byte values: first bytes first.
std::string shuffled_of(const std::string& bytes) {
    std::string shuffled;
    for (std::size_t b = 0; b < 4; ++b)
        for (std::size_t i = b; i < bytes.size(); i += 4) shuffled += bytes[i];
    return shuffled;
}

std::string zlib_of(const std::string& bytes) {
    auto* compressor = libdeflate_alloc_compressor(6);
    std::string packed(libdeflate_zlib_compress_bound(compressor, bytes.size()), '\0');
    packed.resize(
        libdeflate_zlib_compress(compressor, bytes.data(), bytes.size(), packed.data(), packed.size()));
    libdeflate_free_compressor(compressor);
    return packed;
}

TEST(SourceRefusals, RefusesDamagedChunks) {
    const TemporaryFolder folder;
    const auto path = folder / "clip.h5";
    const auto values = testing::smooth_positions(2, 200);
    const std::string plain(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(float));
    const std::string shuffled = shuffled_of(plain);
    const std::string packed = zlib_of(shuffled);
    std::string wrong_checksum = packed;
    wrong_checksum.back() = static_cast<char>(wrong_checksum.back() ^ 1);
    struct Case {
        const char* what;
        std::string bytes;
        std::uint32_t filter_mask;  ///< bit 0: was not shuffled, bit 1: was not deflated
        bool good;
    };
    for (const Case& c : {Case{"whole", packed, 0, true}, Case{"not deflated", shuffled, 2, true},
                          Case{"neither", plain, 3, true}, Case{"not shuffled", zlib_of(plain), 1, true},
                          Case{"cut", packed.substr(0, packed.size() - 1), 0, false},
                          Case{"too short", zlib_of(shuffled.substr(1)), 0, false},
                          Case{"too long", zlib_of(shuffled + "x"), 0, false},
                          Case{"wrong checksum", wrong_checksum, 0, false},
                          Case{"not deflated and short", shuffled.substr(1), 2, false},
                          Case{"not deflated and long", shuffled + "x", 2, false},
                          Case{"garbage", std::string(60, '\x55'), 0, false}}) {
        write_raw_chunk(path, c.bytes, c.filter_mask);
        const auto clip = SourceClip::open(path);
        ASSERT_TRUE(clip) << c.what << ": " << clip.error().to_string();
        for (std::int64_t frame = 0; frame < 2; ++frame) {  // one call unpacks, the next meets what was kept
            std::vector<float> out(600);
            const auto read = (*clip)->read_frames(frame, {out.data(), 1, 200});
            ASSERT_EQ(read.has_value(), c.good) << c.what;
            if (c.good) {
                EXPECT_EQ(out, part_of(values, frame, 1, 200)) << c.what;
                continue;
            }
            EXPECT_EQ(read.error().code, ErrorCode::kCorrupt) << c.what;
            EXPECT_NE(read.error().message.find("chunk at frame 0"), std::string::npos);
        }
    }
}

TEST(SourceRefusals, NamesTheVertexThatIsNotFinite) {
    const TemporaryFolder folder;
    const auto path = folder / "clip.h5";
    const double infinity = std::numeric_limits<double>::infinity();
    for (const double bad : {std::nan(""), infinity, -infinity, 1e39}) {
        for (const bool wide : {false, true}) {
            if (bad == 1e39 && !wide) continue;
            for (const bool packed : {false, true}) {
                const auto smooth = testing::smooth_positions(kFrames, kVertices);
                std::vector<double> values(smooth.begin(), smooth.end());
                values[(19 * kVertices + 40) * 3 + 1] = bad;
                {
                    HandmadeFile file(path);
                    file.add("positions", wide ? H5T_IEEE_F64LE : H5T_IEEE_F32LE, {kFrames, kVertices, 3},
                             {4, kVertices, 3}, H5T_NATIVE_DOUBLE, values.data(),
                             [&](hid_t properties) { packed ? H5Pset_deflate(properties, 1) : 0; });
                }
                const auto clip = SourceClip::open(path);
                ASSERT_TRUE(clip) << clip.error().to_string();
                EXPECT_EQ(read_range(**clip, 0, 19), part_of(smooth, 0, 19, kVertices));
                std::vector<float> out(static_cast<std::size_t>(5 * kVertices * 3));
                const auto read = (*clip)->read_frames(17, {out.data(), 5, kVertices});
                ASSERT_FALSE(read);
                EXPECT_EQ(read.error().code, ErrorCode::kNotFinite);
                EXPECT_NE(read.error().message.find("at frame 19, vertex 40, coordinate y"),
                          std::string::npos)
                    << read.error().to_string();
                EXPECT_EQ(read.error().message.starts_with("NaN"), std::isnan(bad));
            }
        }
    }
}

TEST(SourceRefusals, RefusesFramesThatItDoesNotHave) {
    const TemporaryFolder folder;
    const auto path = folder / "clip.h5";
    { HandmadeFile(path).add_positions(testing::smooth_positions(4, 5), 4, 5); }
    const auto clip = SourceClip::open(path);
    ASSERT_TRUE(clip);
    std::vector<float> out(200);
    for (const auto& [begin, count] :
         {std::pair<std::int64_t, std::int64_t>{-1, 1}, {0, 5}, {4, 1}, {5, 0}}) {
        const auto read = (*clip)->read_frames(begin, {out.data(), count, 5});
        ASSERT_FALSE(read) << begin << " + " << count;
        EXPECT_EQ(read.error().code, ErrorCode::kOutOfRange);
    }
    EXPECT_TRUE((*clip)->read_frames(4, {out.data(), 0, 5}));
    EXPECT_EQ((*clip)->read_frames(0, {out.data(), 1, 6}).error().code, ErrorCode::kInvalidArgument);
}

}  // namespace
}  // namespace batchenc
