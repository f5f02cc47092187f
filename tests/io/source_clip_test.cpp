#include "io/source_clip.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

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

// ---- every storage that HDF5 offers reads the same ----

struct Storage {
    const char* name;
    std::vector<hsize_t> chunk;
    bool shuffle = false;
    int deflate = -1;
    bool fletcher32 = false;
    H5D_layout_t layout = H5D_LAYOUT_ERROR;  ///< where not chunked
    bool reversed = false;                   ///< deflate before shuffle
};

void PrintTo(const Storage& storage, std::ostream* out) { *out << storage.name; }

const Storage kStorages[] = {
    {"contiguous", {}, false, -1, false, H5D_CONTIGUOUS},
    {"compact", {}, false, -1, false, H5D_COMPACT},
    {"chunked", {4, 41, 3}},
    {"frames_deflate", {4, 41, 3}, false, 6},
    {"frames_shuffle_deflate", {4, 41, 3}, true, 6},
    {"one_chunk", {23, 41, 3}, true, 9},
    {"larger_than_the_clip", {64, 50, 4}, true, 4},
    {"guessed_by_h5py", {3, 11, 1}, true, 4},
    {"two_of_three_coordinates", {5, 41, 2}, true, 1},
    {"single_values", {1, 1, 1}, false, 1},
    {"fletcher32", {4, 41, 3}, true, 6, true},
    {"shuffle_only", {4, 41, 3}, true},
    {"deflate_then_shuffle", {4, 41, 3}, true, 6, false, H5D_LAYOUT_ERROR, true},
    {"deflate_level_0", {4, 41, 3}, true, 0},
};

struct StoredType {
    const char* name;
    hid_t (*type)();
};

void PrintTo(const StoredType& type, std::ostream* out) { *out << type.name; }

const StoredType kTypes[] = {
    {"float32_le", [] { return H5T_IEEE_F32LE; }},
    {"float32_be", [] { return H5T_IEEE_F32BE; }},
    {"float64_le", [] { return H5T_IEEE_F64LE; }},
    {"float64_be", [] { return H5T_IEEE_F64BE; }},
};

class SourceStorage : public ::testing::TestWithParam<std::tuple<Storage, StoredType, bool>> {};

TEST_P(SourceStorage, ReadsTheSameInAnyOrderAndExecutor) {
    const auto& [storage, stored_type, noise] = GetParam();
    const TemporaryFolder folder;
    const auto path = folder / "clip.h5";
    const auto values =
        noise ? testing::noise_positions(kFrames, kVertices) : testing::smooth_positions(kFrames, kVertices);
    {
        HandmadeFile file(path);
        file.add("positions", stored_type.type(), {kFrames, kVertices, 3}, storage.chunk, H5T_NATIVE_FLOAT,
                 values.data(), [&storage = storage](hid_t properties) {
                     if (storage.layout != H5D_LAYOUT_ERROR) H5Pset_layout(properties, storage.layout);
                     if (storage.reversed) H5Pset_deflate(properties, static_cast<unsigned>(storage.deflate));
                     if (storage.shuffle) H5Pset_shuffle(properties);
                     if (!storage.reversed && storage.deflate >= 0)
                         H5Pset_deflate(properties, static_cast<unsigned>(storage.deflate));
                     if (storage.fletcher32) H5Pset_fletcher32(properties);
                 });
    }
    const auto clip = SourceClip::open(path);
    ASSERT_TRUE(clip) << clip.error().to_string();
    EXPECT_EQ((*clip)->frame_count(), kFrames);
    EXPECT_EQ((*clip)->vertex_count(), kVertices);
    EXPECT_EQ((*clip)->triangle_count(), 0);
    EXPECT_EQ(read_range(**clip, 0, kFrames), values);
    EXPECT_EQ(read_range(**clip, 0, kFrames, ShuffledExecutor(3)), values);
    for (const std::int64_t length : {1, 3, 7}) {  // in order, through and beside the chunks' borders
        for (std::int64_t begin = 0; begin < kFrames; begin += length) {
            const std::int64_t count = std::min(length, kFrames - begin);
            ASSERT_EQ(read_range(**clip, begin, count), part_of(values, begin, count, kVertices))
                << "frame " << begin << " + " << count;
        }
    }
    std::mt19937 random(5);
    for (int i = 0; i < 20; ++i) {  // forth and back, so that kept chunks are met where nobody planned it
        const auto begin = static_cast<std::int64_t>(random() % kFrames);
        const auto count = static_cast<std::int64_t>(random() % (kFrames - begin)) + 1;
        ASSERT_EQ(read_range(**clip, begin, count, ShuffledExecutor(random())),
                  part_of(values, begin, count, kVertices));
    }
}

INSTANTIATE_TEST_SUITE_P(All, SourceStorage,
                         ::testing::Combine(::testing::ValuesIn(kStorages), ::testing::ValuesIn(kTypes),
                                            ::testing::Bool()),
                         [](const auto& test) {
                             return std::string(std::get<0>(test.param).name) + "_" +
                                    std::get<1>(test.param).name +
                                    (std::get<2>(test.param) ? "_noise" : "_smooth");
                         });

TEST(SourceClip, RoundsFloat64ToNearest) {
    const TemporaryFolder folder;
    const auto path = folder / "clip.h5";
    const std::vector<double> values = {0.1, 1e-42, -1.0 / 3.0, 16777217.0, 3.4e38, -0.0};
    for (const bool packed : {false, true}) {
        {
            HandmadeFile file(path);
            file.add("positions", H5T_IEEE_F64LE, {1, 2, 3},
                     packed ? std::vector<hsize_t>{1, 2, 3} : std::vector<hsize_t>{}, H5T_NATIVE_DOUBLE,
                     values.data(), [&](hid_t properties) { packed ? H5Pset_deflate(properties, 6) : 0; });
        }
        const auto clip = SourceClip::open(path);
        ASSERT_TRUE(clip) << clip.error().to_string();
        const auto read = read_range(**clip, 0, 1);
        for (std::size_t i = 0; i < values.size(); ++i) EXPECT_EQ(read[i], static_cast<float>(values[i]));
    }
}

// ---- triangles and attributes ----

class TriangleTypes : public ::testing::TestWithParam<StoredType> {};

TEST_P(TriangleTypes, Read) {
    const TemporaryFolder folder;
    const auto path = folder / "clip.h5";
    const std::vector<std::int32_t> indices = {0, 1, 2, 3, 2, 1, 40, 0, 5};
    {
        HandmadeFile file(path);
        file.add_positions(testing::smooth_positions(2, kVertices), 2, kVertices);
        file.add("triangles", GetParam().type(), {3, 3}, {2, 3}, H5T_NATIVE_INT32, indices.data(),
                 [](hid_t properties) { H5Pset_deflate(properties, 6); });
    }
    const auto clip = SourceClip::open(path);
    ASSERT_TRUE(clip) << clip.error().to_string();
    EXPECT_EQ((*clip)->triangle_count(), 3);
    const auto triangles = (*clip)->read_triangles();
    ASSERT_TRUE(triangles) << triangles.error().to_string();
    EXPECT_EQ(*triangles, (std::vector<Triangle>{{0, 1, 2}, {3, 2, 1}, {40, 0, 5}}));
}

INSTANTIATE_TEST_SUITE_P(All, TriangleTypes,
                         ::testing::Values(StoredType{"int32_le", [] { return H5T_STD_I32LE; }},
                                           StoredType{"int32_be", [] { return H5T_STD_I32BE; }},
                                           StoredType{"int64_le", [] { return H5T_STD_I64LE; }},
                                           StoredType{"int64_be", [] { return H5T_STD_I64BE; }}),
                         [](const auto& test) { return test.param.name; });

TEST(SourceClip, NamesTheTriangleOutOfRange) {
    const TemporaryFolder folder;
    const auto path = folder / "clip.h5";
    for (const std::int64_t bad : {std::int64_t{41}, std::int64_t{-1}, std::int64_t{1} << 32}) {
        const std::int64_t indices[] = {0, 1, 2, 3, bad, 1};
        {
            HandmadeFile file(path);
            file.add_positions(testing::smooth_positions(2, kVertices), 2, kVertices);
            file.add("triangles", H5T_STD_I64LE, {2, 3}, H5T_NATIVE_INT64, indices);
        }
        const auto clip = SourceClip::open(path);
        ASSERT_TRUE(clip) << clip.error().to_string();
        const auto triangles = (*clip)->read_triangles();
        ASSERT_FALSE(triangles);
        EXPECT_EQ(triangles.error().code, ErrorCode::kOutOfRange);
        EXPECT_EQ(triangles.error().message,
                  "triangle 1 has vertex index " + std::to_string(bad) + "; the clip has 41 vertices");
    }
}

/// Adds a scalar attribute to the root.
void add_attribute(hid_t file, const char* name, hid_t type, const void* value) {
    const hid_t space = H5Screate(H5S_SCALAR);
    const hid_t attribute = H5Acreate2(file, name, type, space, H5P_DEFAULT, H5P_DEFAULT);
    H5Awrite(attribute, type, value);
    H5Aclose(attribute);
    H5Sclose(space);
}

TEST(SourceClip, ReadsAttributesOfAnySaneType) {
    const TemporaryFolder folder;
    const auto path = folder / "clip.h5";
    const hid_t variable = H5Tcopy(H5T_C_S1);
    H5Tset_size(variable, H5T_VARIABLE);
    const hid_t fixed = H5Tcopy(H5T_C_S1);
    H5Tset_size(fixed, 8);
    const hid_t spaces = H5Tcopy(H5T_FORTRAN_S1);
    H5Tset_size(spaces, 8);
    const char* text = "walker";
    const std::int32_t whole = 25;
    const float single = 23.5F;
    const double nonsense = std::numeric_limits<double>::quiet_NaN();
    const double negative = -1.0;
    struct Case {
        hid_t fps_type;
        const void* fps;
        double expected_fps;
        hid_t name_type;
        const void* name;
        std::string expected_name;
    };
    for (const Case& c : {Case{H5T_NATIVE_DOUBLE, &nonsense, 0.0, variable, &text, "walker"},
                          Case{H5T_NATIVE_INT32, &whole, 25.0, fixed, "walker\0", "walker"},
                          Case{H5T_NATIVE_FLOAT, &single, 23.5, spaces, "walker  ", "walker"},
                          Case{variable, &text, 0.0, H5T_NATIVE_INT32, &whole, ""},
                          Case{H5T_NATIVE_DOUBLE, &negative, 0.0, fixed, "12345678", "12345678"}}) {
        {
            HandmadeFile file(path);
            file.add_positions(testing::smooth_positions(2, 3), 2, 3);
            add_attribute(file.id(), "fps", c.fps_type, c.fps);
            add_attribute(file.id(), "name", c.name_type, c.name);
        }
        const auto clip = SourceClip::open(path);
        ASSERT_TRUE(clip) << clip.error().to_string();
        EXPECT_EQ((*clip)->fps(), c.expected_fps);
        EXPECT_EQ((*clip)->name(), c.expected_name);
    }
    H5Tclose(variable);
    H5Tclose(fixed);
    H5Tclose(spaces);
}

TEST(SourceClip, ReadsDatasetsInGroupsAndUnderOtherNames) {
    const TemporaryFolder folder;
    const auto path = folder / "clip.h5";
    const auto values = testing::smooth_positions(3, 4);
    {
        HandmadeFile file(path);
        H5Gclose(H5Gcreate2(file.id(), "a", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
        file.add("a/points", H5T_IEEE_F32LE, {3, 4, 3}, H5T_NATIVE_FLOAT, values.data());
    }
    for (const char* name : {"/a/points", "a/points", "/a//points/"}) {
        const auto clip = SourceClip::open(path, {name, "/triangles"});
        ASSERT_TRUE(clip) << clip.error().to_string();
        EXPECT_EQ(read_range(**clip, 0, 3), values);
    }
}

TEST(SourceClip, ReadsRealClips) {
    const std::filesystem::path data = std::filesystem::path(BATCHENC_DATA_DIR) / "dynamic";
    if (!std::filesystem::exists(data / "eagle.h5")) GTEST_SKIP() << "no sample clips in " << data;
    const auto sequence = read_mesh_sequence(data / "eagle.h5");
    ASSERT_TRUE(sequence) << sequence.error().to_string();
    EXPECT_EQ(sequence->name, "eagle");  // a string of variable length, as h5py writes it
    EXPECT_EQ(sequence->fps, 30.0);
    EXPECT_EQ(sequence->vertex_count, 636);
    EXPECT_EQ(sequence->frame_count, 31);
    EXPECT_EQ(sequence->triangles.size(), 792U);
    EXPECT_EQ(sequence->positions.size(), 31U * 636U * 3U);
}

}  // namespace
}  // namespace batchenc
