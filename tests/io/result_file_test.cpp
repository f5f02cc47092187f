#include "io/result_file.h"

#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <thread>

#include "tests/io/hdf5_test_file.h"
#include "tests/io/result_test_content.h"
#include "tests/io/small_disk.h"

namespace batchenc {
namespace {

using testing::difference;
using testing::ResultContent;
using testing::TemporaryFolder;
using testing::write_result;

void expect_open_fails(const std::filesystem::path& path, ErrorCode code, const std::string& words) {
    const auto reader = ResultReader::open(path);
    ASSERT_FALSE(reader) << "opened although " << words;
    EXPECT_EQ(reader.error().code, code) << reader.error().to_string();
    EXPECT_NE(reader.error().to_string().find(words), std::string::npos) << reader.error().to_string();
    EXPECT_NE(reader.error().where.find(path.string()), std::string::npos) << reader.error().to_string();
}

TEST(ResultFile, RoundTrips) {
    const TemporaryFolder folder;
    const ResultContent content;
    const auto written = write_result(folder / "made/here/result.h5", content, false);
    ASSERT_TRUE(written) << written.error().to_string();
    EXPECT_EQ(difference(folder / "made/here/result.h5", content), "");
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder / "made/here"), {}), 1);
}

TEST(ResultFile, RoundTripsPointsWithoutAnalysisAndEmptyTexts) {
    const TemporaryFolder folder;
    ResultContent content;
    content.header.triangle_count = 0;
    content.header.name = "";
    content.header.job = "";
    ASSERT_TRUE(write_result(folder / "result.h5", content, false, false));
    EXPECT_EQ(difference(folder / "result.h5", content), "");
}

TEST(ResultFile, RoundTripsALongJob) {
    const TemporaryFolder folder;
    for (const std::size_t size :
         {65'000U, 65'536U, 1'000'000U}) {  // on both sides of an object header's end
        ResultContent content;
        content.header.job.assign(size, 'j');
        content.header.job[size / 2] = '\n';
        const auto written = write_result(folder / "result.h5", content, true);
        ASSERT_TRUE(written) << written.error().to_string();
        EXPECT_EQ(difference(folder / "result.h5", content), "");
    }
}

TEST(ResultFile, RoundTripsManyClips) {
    const TemporaryFolder folder;
    ResultContent content;
    content.clips.clear();
    content.spans.clear();
    content.header.frame_count = 300;
    for (std::int64_t i = 0; i < 300; ++i) {
        content.spans.push_back({i, 1});
        content.clips.emplace_back(static_cast<std::size_t>(i + 1), static_cast<std::uint8_t>(i));
    }
    content.metrics.frame_rmse.assign(300, 1.0);
    content.metrics.frame_max_error.assign(300, 2.0);
    content.metrics.frame_jump.assign(300, 3.0);
    ASSERT_TRUE(write_result(folder / "result.h5", content, false));
    EXPECT_EQ(difference(folder / "result.h5", content), "");
}

TEST(ResultFile, OpensWithoutJumps) {
    const TemporaryFolder folder;
    ResultContent content;
    content.metrics.frame_jump.clear();  // as in results of before they were measured
    ASSERT_TRUE(write_result(folder / "result.h5", content, false));
    EXPECT_EQ(difference(folder / "result.h5", content), "");
}

TEST(ResultFile, WritesTheSameBytesForTheSameContent) {
    const TemporaryFolder folder;
    ASSERT_TRUE(write_result(folder / "a.h5", ResultContent{}, false));
    std::this_thread::sleep_for(std::chrono::milliseconds(1100));  // HDF5 would note the second
    ASSERT_TRUE(write_result(folder / "b.h5", ResultContent{}, false));
    EXPECT_TRUE(testing::read_bytes(folder / "a.h5") == testing::read_bytes(folder / "b.h5"));
}

TEST(ResultFile, RefusesEveryTruncation) {
    const TemporaryFolder folder;
    const auto path = folder / "result.h5";
    const ResultContent content;
    ASSERT_TRUE(write_result(path, content, false));
    for (auto size = std::filesystem::file_size(path); size-- > 0;) {
        std::filesystem::resize_file(path, size);
        ASSERT_TRUE(difference(path, content).starts_with("error: ")) << size;
    }
}

TEST(ResultFile, NoticesFlippedBits) {
    const TemporaryFolder folder;
    const auto path = folder / "result.h5";
    const ResultContent content;
    ASSERT_TRUE(write_result(path, content, false));
    const std::string whole = testing::read_bytes(path);
    std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
    const auto put = [&](std::size_t position, int byte) {
        file.seekp(static_cast<std::streamoff>(position)).put(static_cast<char>(byte)).flush();
        ASSERT_TRUE(file.good());
    };
    std::size_t tried = 0;
    std::size_t noticed = 0;
    // The stride is a prime: it meets every field of the repeated structures of HDF5 and every bit of a byte.
    for (std::size_t bit = 0; bit < whole.size() * 8; bit += 41) {
        const std::size_t position = bit / 8;
        put(position, whole[position] ^ (1 << bit % 8));
        const std::string what = difference(path, content);
        put(position, whole[position]);
        // A bit of the padding between objects may flip unnoticed; nothing that anybody reads may.
        ASSERT_TRUE(what.empty() || what.starts_with("error: ")) << position << ": " << what;
        noticed += what.empty() ? 0 : 1;
        ++tried;
    }
    EXPECT_GT(tried, 2000U);
    EXPECT_GT(noticed, tried / 4);
    EXPECT_EQ(difference(path, content), "");
}

TEST(ResultFile, NoticesFlippedBitsInThePayload) {
    const TemporaryFolder folder;
    const ResultContent content;
    ASSERT_TRUE(write_result(folder / "result.h5", content, false));
    const std::string whole = testing::read_bytes(folder / "result.h5");
    for (const auto& payload : {content.clips[0], content.clips[1], content.connectivity}) {
        const auto at = whole.find(std::string(payload.begin(), payload.end()));
        ASSERT_NE(at, std::string::npos);
        std::string damaged = whole;
        damaged[at + payload.size() / 2] ^= 1;
        testing::write_bytes(folder / "damaged.h5", damaged);
        expect_open_fails(folder / "damaged.h5", ErrorCode::kCorrupt, "does not match its digest");
    }
}

TEST(ResultFile, RefusesWhatIsNoResult) {
    const TemporaryFolder folder;
    expect_open_fails(folder / "missing.h5", ErrorCode::kIo, "No such file");
    testing::write_bytes(folder / "text.h5", "hello");
    expect_open_fails(folder / "text.h5", ErrorCode::kFormat, "not an HDF5 file");
    { testing::HandmadeFile(folder / "clip.h5").add_positions(testing::smooth_positions(2, 3), 2, 3); }
    expect_open_fails(folder / "clip.h5", ErrorCode::kFormat, "not a batchenc result");
}

/// Opens a written result for changes behind the writer's back.
void change_result(const std::filesystem::path& path, const std::function<void(hid_t)>& change) {
    const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
    ASSERT_GE(file, 0);
    change(file);
    ASSERT_GE(H5Fclose(file), 0);
}

TEST(ResultFile, RefusesFutureVersions) {
    const TemporaryFolder folder;
    const auto path = folder / "result.h5";
    ASSERT_TRUE(write_result(path, ResultContent{}, false));
    change_result(path, [](hid_t file) {
        const std::int64_t version = 2;
        const hid_t attribute = H5Aopen(file, "format_version", H5P_DEFAULT);
        H5Awrite(attribute, H5T_NATIVE_INT64, &version);
        H5Aclose(attribute);
    });
    expect_open_fails(path, ErrorCode::kUnsupported, "format version 2");
}

TEST(ResultFile, NoticesEveryKindOfChange) {
    const TemporaryFolder folder;
    const auto path = folder / "result.h5";
    struct Change {
        const char* what;
        std::function<void(hid_t)> apply;
        const char* words = "";
    };
    const hid_t plain = H5P_DEFAULT;
    const Change changes[] = {
        {"renamed attribute", [=](hid_t f) { H5Arename_by_name(f, "/metrics", "da", "db", plain); }},
        {"removed attribute", [](hid_t f) { H5Adelete(f, "job"); }},
        {"no digest", [](hid_t f) { H5Adelete(f, "digest"); }},
        {"removed analysis", [=](hid_t f) { H5Ldelete(f, "/analysis/000001/labels", plain); }},
        {"removed clip", [=](hid_t f) { H5Ldelete(f, "/clips/000001", plain); }},
        {"moved clip", [=](hid_t f) { H5Lmove(f, "/clips/000001", f, "/clips/000002", plain, plain); }},
        {"another group", [=](hid_t f) { H5Gclose(H5Gcreate2(f, "/more", plain, plain, plain)); }},
        {"soft link", [=](hid_t f) { H5Lcreate_soft("/clips", f, "/analysis/soft", plain, plain); }},
        {"external link", [=](hid_t f) { H5Lcreate_external("x", "/", f, "/analysis/x", plain, plain); }},
        {"cycle", [=](hid_t f) { H5Lcreate_hard(f, "/", f, "/analysis/again", plain, plain); },
         "nested too deeply"},
    };
    for (const Change& change : changes) {
        ASSERT_TRUE(write_result(path, ResultContent{}, true));
        change_result(path, change.apply);
        SCOPED_TRACE(change.what);
        expect_open_fails(path, ErrorCode::kCorrupt, change.words);
    }
}

/// Replaces a dataset of a result by one that is made with `configure(properties)`.
template <typename Configure>
void replace_dataset(hid_t file, const char* name, hid_t type, hsize_t extent, const Configure& configure) {
    H5Ldelete(file, name, H5P_DEFAULT);
    const hid_t properties = H5Pcreate(H5P_DATASET_CREATE);
    configure(properties);
    const hid_t space = H5Screate_simple(1, &extent, nullptr);
    H5Dclose(H5Dcreate2(file, name, type, space, H5P_DEFAULT, properties, H5P_DEFAULT));
    H5Sclose(space);
    H5Pclose(properties);
}

TEST(ResultFile, RefusesOtherStorageBeforeReadingIt) {
    const TemporaryFolder folder;
    const auto path = folder / "result.h5";
    testing::write_bytes(folder / "secret.bin", std::string(100, 's'));
    const std::string secret = folder / "secret.bin";
    const char* name = "/clips/000000/bitstream";
    const auto expect_refused = [&](const char* words, const std::function<void(hid_t)>& change) {
        ASSERT_TRUE(write_result(path, ResultContent{}, true));
        change_result(path, change);
        expect_open_fails(path, ErrorCode::kCorrupt, words);
    };
    expect_refused("not stored contiguously", [&](hid_t file) {
        replace_dataset(file, name, H5T_STD_U8LE, 100,
                        [&](hid_t p) { H5Pset_external(p, secret.c_str(), 0, 100); });
    });
    expect_refused("not stored contiguously", [&](hid_t file) {
        replace_dataset(file, name, H5T_STD_U8LE, 100, [](hid_t p) {
            const hsize_t chunk = 10;
            H5Pset_chunk(p, 1, &chunk);
        });
    });
    expect_refused("not stored contiguously", [&](hid_t file) {
        replace_dataset(file, name, H5T_STD_U8LE, 100, [](hid_t p) { H5Pset_layout(p, H5D_COMPACT); });
    });
    expect_refused("which the file does not hold", [&](hid_t file) {
        replace_dataset(file, name, H5T_STD_U8LE, hsize_t{1} << 46, [](hid_t) {});
    });
    expect_refused("does not lie inside the file",
                   [&](hid_t file) { replace_dataset(file, name, H5T_STD_U8LE, 100, [](hid_t) {}); });
    expect_refused("type that results do not have",
                   [&](hid_t file) { replace_dataset(file, name, H5T_STD_U16LE, 50, [](hid_t) {}); });
}

TEST(ResultWriter, RefusesWhatDoesNotFitTogether) {
    const TemporaryFolder folder;
    const auto path = folder / "result.h5";
    const ResultContent good;
    const auto expect_refused = [&](const char* what, const std::function<void(ResultContent&)>& change) {
        ResultContent content;
        change(content);
        const auto written = write_result(path, content, true);
        ASSERT_FALSE(written) << what;
        EXPECT_EQ(written.error().code, ErrorCode::kInvalidArgument) << what;
        EXPECT_EQ(folder.file_count(), 0U) << what;
    };
    expect_refused("gap", [](auto& c) { c.spans[1].first_frame = 5; });
    expect_refused("too long", [](auto& c) { c.spans[1].frame_count = 4; });
    expect_refused("too short", [](auto& c) { c.spans[1].frame_count = 2; });
    expect_refused("empty clip", [](auto& c) { c.clips[0].clear(); });
    expect_refused("empty connectivity", [](auto& c) { c.connectivity.clear(); });
    expect_refused("few labels", [](auto& c) { c.labels.pop_back(); });
    expect_refused("few errors", [](auto& c) { c.vertex_rmse.pop_back(); });
    expect_refused("no clusters", [](auto& c) { c.cluster_deviation.clear(); });
    expect_refused("few frames", [](auto& c) { c.metrics.frame_rmse.pop_back(); });
    expect_refused("few jumps", [](auto& c) { c.metrics.frame_jump.pop_back(); });
    expect_refused("NUL", [](auto& c) { c.header.job = std::string("a\0b", 3); });
    expect_refused("no vertices", [](auto& c) { c.header.vertex_count = 0; });

    auto writer = ResultWriter::create(path, good.header, false);
    ASSERT_TRUE(writer);
    EXPECT_FALSE((*writer)->write_analysis({good.labels, good.vertex_rmse, good.cluster_deviation}))
        << "before any clip";
    EXPECT_FALSE((*writer)->write_connectivity(good.connectivity)) << "after a failure";
}

TEST(ResultWriter, KeepsWhatExistsUnlessToldOtherwise) {
    const TemporaryFolder folder;
    const auto path = folder / "result.h5";
    testing::write_bytes(path, "mine");
    const auto refused = write_result(path, ResultContent{}, false);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::kExists);
    EXPECT_EQ(testing::read_bytes(path), "mine");
    EXPECT_TRUE(write_result(path, ResultContent{}, true));
    EXPECT_EQ(difference(path, ResultContent{}), "");
    EXPECT_EQ(folder.file_count(), 1U);
}

TEST(ResultWriter, LeavesNothingWithoutFinish) {
    const TemporaryFolder folder;
    const ResultContent content;
    {
        auto writer = ResultWriter::create(folder / "result.h5", content.header, false);
        ASSERT_TRUE(writer);
        ASSERT_TRUE((*writer)->write_clip(content.spans[0], content.clips[0]));
        EXPECT_EQ(folder.file_count(), 1U);
    }
    EXPECT_EQ(folder.file_count(), 0U);
}

TEST(ResultWriter, TwoWritersOfOnePlaceDoNotMeet) {
    const TemporaryFolder folder;
    const ResultContent content;
    auto first = ResultWriter::create(folder / "result.h5", content.header, true);
    ASSERT_TRUE(first);
    EXPECT_TRUE(write_result(folder / "result.h5", content, true));
    first->reset();
    EXPECT_EQ(difference(folder / "result.h5", content), "");
    EXPECT_EQ(folder.file_count(), 1U);
}

TEST(ResultWriter, LeavesTheOldFileOnAFullDisk) {
    const TemporaryFolder folder;
    const auto path = folder / "result.h5";
    const ResultContent old_content;
    ResultContent new_content;
    new_content.clips[0].assign(3000, 0xee);
    ASSERT_TRUE(write_result(folder / "new.h5", new_content, false));
    const auto size = std::filesystem::file_size(folder / "new.h5");
    std::filesystem::remove(folder / "new.h5");
    ASSERT_TRUE(write_result(path, old_content, false));
    for (rlim_t room = 0; room < size; room += 61) {
        const auto written = [&] {
            const testing::SmallDisk disk(room);
            return write_result(path, new_content, true);
        }();
        ASSERT_FALSE(written) << room;
        EXPECT_EQ(written.error().code, ErrorCode::kIo) << written.error().to_string();
        ASSERT_EQ(difference(path, old_content), "") << room;
        ASSERT_EQ(folder.file_count(), 1U) << room;
    }
    EXPECT_TRUE(write_result(path, new_content, true));
    EXPECT_EQ(difference(path, new_content), "");
}

}  // namespace
}  // namespace batchenc
