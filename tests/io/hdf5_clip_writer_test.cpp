#include <gtest/gtest.h>

#include "io/source_clip.h"
#include "tests/io/hdf5_test_file.h"
#include "tests/io/small_disk.h"

namespace batchenc {
namespace {

using testing::TemporaryFolder;

constexpr std::int64_t kFrames = 7;
constexpr std::int64_t kVertices = 50;
const std::vector<Triangle> kTriangles = {{0, 1, 2}, {2, 1, 3}};

Expected<void> write_clip(const std::filesystem::path& path, const std::vector<float>& values,
                          bool overwrite) {
    auto writer = ClipWriter::create(path, kFrames, kVertices, kTriangles, 24.0, "walker", overwrite);
    if (!writer) return tl::unexpected(writer.error());
    for (std::int64_t f = 0; f < kFrames; f += 3) {
        const std::int64_t count = std::min<std::int64_t>(3, kFrames - f);
        auto written = (*writer)->write_frames(f, {values.data() + f * kVertices * 3, count, kVertices});
        if (!written) return written;
    }
    return (*writer)->finish();
}

TEST(ClipWriter, RoundTrips) {
    const TemporaryFolder folder;
    const auto values = testing::noise_positions(kFrames, kVertices);
    const auto written = write_clip(folder / "clip.h5", values, false);
    ASSERT_TRUE(written) << written.error().to_string();
    EXPECT_EQ(folder.file_count(), 1U);
    const auto read = read_mesh_sequence(folder / "clip.h5");
    ASSERT_TRUE(read) << read.error().to_string();
    EXPECT_EQ(read->positions, values);
    EXPECT_EQ(read->triangles, kTriangles);
    EXPECT_EQ(read->fps, 24.0);
    EXPECT_EQ(read->name, "walker");
}

TEST(ClipWriter, KeepsWhatExistsUnlessToldOtherwise) {
    const TemporaryFolder folder;
    const auto path = folder / "clip.h5";
    const auto values = testing::noise_positions(kFrames, kVertices);
    testing::write_bytes(path, "mine");
    const auto refused = write_clip(path, values, false);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::kExists);
    EXPECT_EQ(testing::read_bytes(path), "mine");
    EXPECT_EQ(folder.file_count(), 1U);
    EXPECT_TRUE(write_clip(path, values, true));
    EXPECT_EQ(folder.file_count(), 1U);
    EXPECT_TRUE(SourceClip::open(path));
}

TEST(ClipWriter, LeavesAFileThatAppearedMeanwhile) {
    const TemporaryFolder folder;
    const auto path = folder / "clip.h5";
    const auto values = testing::noise_positions(kFrames, kVertices);
    auto writer = ClipWriter::create(path, kFrames, kVertices, kTriangles, 24.0, "", false);
    ASSERT_TRUE(writer);
    ASSERT_TRUE((*writer)->write_frames(0, {values.data(), kFrames, kVertices}));
    testing::write_bytes(path, "mine");
    const auto finished = (*writer)->finish();
    ASSERT_FALSE(finished);
    EXPECT_EQ(finished.error().code, ErrorCode::kExists);
    EXPECT_EQ(testing::read_bytes(path), "mine");
    EXPECT_EQ(folder.file_count(), 1U);
}

TEST(ClipWriter, LeavesTemporaryFilesOfOthersAlone) {
    const TemporaryFolder folder;
    const auto path = folder / "clip.h5";
    int number = -1;  // of the first writer's temporary file, "clip.h5.PID.NUMBER.tmp"
    {
        auto writer = ClipWriter::create(path, kFrames, kVertices, {}, 0.0, "", false);
        ASSERT_TRUE(writer);
        while (!std::filesystem::exists(folder / testing::temporary_name("clip.h5", ++number)))
            ASSERT_LT(number, 10'000);
    }
    for (int i = 1; i <= 3; ++i)
        testing::write_bytes(folder / testing::temporary_name("clip.h5", number + i), "theirs");
    ASSERT_TRUE(write_clip(path, testing::noise_positions(kFrames, kVertices), false));
    EXPECT_EQ(folder.file_count(), 4U);
    for (int i = 1; i <= 3; ++i)
        EXPECT_EQ(testing::read_bytes(folder / testing::temporary_name("clip.h5", number + i)), "theirs");
}

TEST(ClipWriter, LeavesNothingWithoutFinish) {
    const TemporaryFolder folder;
    const auto values = testing::noise_positions(kFrames, kVertices);
    {
        auto writer = ClipWriter::create(folder / "clip.h5", kFrames, kVertices, {}, 0.0, "", false);
        ASSERT_TRUE(writer);
        ASSERT_TRUE((*writer)->write_frames(2, {values.data(), 1, kVertices}));
        EXPECT_EQ(folder.file_count(), 1U);
        EXPECT_FALSE(std::filesystem::exists(folder / "clip.h5"));
    }
    EXPECT_EQ(folder.file_count(), 0U);
}

TEST(ClipWriter, RefusesToFinishWithFramesMissing) {
    const TemporaryFolder folder;
    const auto values = testing::noise_positions(kFrames, kVertices);
    auto writer = ClipWriter::create(folder / "clip.h5", kFrames, kVertices, {}, 0.0, "", false);
    ASSERT_TRUE(writer);
    ASSERT_TRUE((*writer)->write_frames(0, {values.data(), 4, kVertices}));
    ASSERT_TRUE((*writer)->write_frames(5, {values.data(), 2, kVertices}));
    const auto finished = (*writer)->finish();
    ASSERT_FALSE(finished);
    EXPECT_NE(finished.error().message.find("frame 4 was never written"), std::string::npos);
    EXPECT_EQ(folder.file_count(), 0U);
    EXPECT_FALSE((*writer)->finish());
}

TEST(ClipWriter, RefusesFramesThatDoNotFit) {
    const TemporaryFolder folder;
    const auto values = testing::noise_positions(kFrames, kVertices);
    auto writer = ClipWriter::create(folder / "clip.h5", kFrames, kVertices, {}, 0.0, "", false);
    ASSERT_TRUE(writer);
    EXPECT_FALSE((*writer)->write_frames(1, {values.data(), kFrames, kVertices}));
    EXPECT_FALSE((*writer)->write_frames(-1, {values.data(), 1, kVertices}));
    EXPECT_FALSE((*writer)->write_frames(0, {values.data(), 1, kVertices - 1}));
    for (const auto& [frames, vertices] :
         {std::pair<std::int64_t, std::int64_t>{0, 1}, {1, 0}, {1LL << 60, 1 << 30}})
        EXPECT_FALSE(ClipWriter::create(folder / "other.h5", frames, vertices, {}, 0.0, "", false));
    EXPECT_FALSE(ClipWriter::create(folder / "no/folder.h5", 1, 1, {}, 0.0, "", false));
    EXPECT_FALSE(ClipWriter::create(folder / ".", 1, 1, {}, 0.0, "", true));
}

TEST(ClipWriter, LeavesTheOldFileOnAFullDisk) {
    const TemporaryFolder folder;
    const auto path = folder / "clip.h5";
    ASSERT_TRUE(write_clip(path, testing::noise_positions(kFrames, kVertices), false));
    const std::string before = testing::read_bytes(path);
    const auto values = testing::smooth_positions(kFrames, kVertices);
    for (rlim_t room = 0; room < before.size(); room += 97) {
        const auto written = [&] {
            const testing::SmallDisk disk(room);
            return write_clip(path, values, true);
        }();
        ASSERT_FALSE(written) << room;
        EXPECT_EQ(written.error().code, ErrorCode::kIo) << written.error().to_string();
        ASSERT_TRUE(testing::read_bytes(path) == before) << room;
        ASSERT_EQ(folder.file_count(), 1U) << room;
    }
    EXPECT_TRUE(write_clip(path, values, true));
    EXPECT_EQ(read_mesh_sequence(path)->positions, values);
}

}  // namespace
}  // namespace batchenc
