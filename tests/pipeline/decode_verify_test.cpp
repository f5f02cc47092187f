#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>

#include "codecs/connectivity_bitstream.h"
#include "io/result_file.h"
#include "kernels/edge_distortion.h"
#include "pipeline/decode_result.h"
#include "pipeline/tbb_executor.h"
#include "pipeline/verify_result.h"
#include "tests/pipeline/batch_fixture.h"
#include "tests/support/sample_meshes.h"

namespace batchenc {
namespace {

constexpr std::int64_t kMemory = 1LL << 30;

class DecodeVerify : public BatchTest {
 protected:
    void SetUp() override {
        BatchTest::SetUp();
        source_ = waving_sheet(20);
        write_clip("sheet.h5", source_);
    }

    void encode(const Job& job) {
        const auto plans = plan_jobs({job}, ExistingOutput::kReplace, stop_);
        const auto report = run_batch(plans, {kMemory, 2}, TbbExecutor(stop_), stop_, listener_);
        ASSERT_TRUE(report.all_done()) << report.jobs[0].error->to_string();
    }

    DecodeRequest request(const std::string& name) const {
        DecodeRequest request;
        request.result = output("a");
        request.output = folder_ / name;
        request.memory_bytes = kMemory;
        return request;
    }
    Expected<DecodeReport> decode(const DecodeRequest& request) const {
        return decode_result(request, TbbExecutor(stop_), stop_, [](double) {});
    }
    Expected<VerifyReport> verify(const std::filesystem::path& source) const {
        return verify_result(output("a"), source, kMemory, TbbExecutor(stop_), stop_, [](double) {});
    }
    void expect_verified() {
        const auto report = verify(folder_ / "sheet.h5");
        ASSERT_TRUE(report) << report.error().to_string();
        for (const VerifiedFigure& figure : report->figures)
            EXPECT_TRUE(figure.agrees) << figure.name << " " << figure.recorded << " " << figure.measured;
        EXPECT_TRUE(report->same_triangles);
        EXPECT_TRUE(report->agrees());
    }

    MeshSequence source_;
};

TEST_F(DecodeVerify, DecodesWhatWasEncoded) {
    encode(make_job("a", "sheet.h5", "clips: {length: 7}\n"));
    const auto report = decode(request("back.h5"));
    ASSERT_TRUE(report) << report.error().to_string();
    const auto back = read_mesh_sequence(folder_ / "back.h5");
    ASSERT_TRUE(back) << back.error().to_string();
    EXPECT_EQ(back->frame_count, 20);
    EXPECT_EQ(back->triangles, source_.triangles);
    EXPECT_EQ(back->fps, 25.0);
    EXPECT_EQ(back->name, "sheet");
    ASSERT_EQ(back->positions.size(), source_.positions.size());
    for (std::size_t i = 0; i < back->positions.size(); ++i)
        ASSERT_NEAR(back->positions[i], source_.positions[i], 0.05) << i;
}

TEST_F(DecodeVerify, FrameRangeIsASliceOfTheWhole) {
    encode(make_job("a", "sheet.h5", "clips: {length: 7}\n"));
    ASSERT_TRUE(decode(request("back.h5")));
    const auto whole = read_mesh_sequence(folder_ / "back.h5");
    for (const auto& [begin, end] : {std::pair{0, 20}, {5, 9}, {7, 14}, {6, 15}, {19, 20}}) {
        DecodeRequest part = request("part.h5");
        part.frame_begin = begin;
        part.frame_end = end;
        part.overwrite = true;
        ASSERT_TRUE(decode(part));
        const auto slice = read_mesh_sequence(part.output);
        ASSERT_TRUE(slice);
        const std::size_t frame = 3 * 144;
        EXPECT_EQ(slice->positions,
                  std::vector<float>(whole->positions.begin() + static_cast<std::ptrdiff_t>(begin * frame),
                                     whole->positions.begin() + static_cast<std::ptrdiff_t>(end * frame)));
    }
}

TEST_F(DecodeVerify, FewerComponentsAreWorse) {
    encode(make_job("a", "sheet.h5"));
    double last_error = std::numeric_limits<double>::infinity();
    for (const int components : {1, 2, 3, 4}) {
        DecodeRequest part = request("part.h5");
        part.components = components;
        part.overwrite = true;
        ASSERT_TRUE(decode(part));
        const auto back = read_mesh_sequence(part.output);
        double error = 0.0;
        for (std::size_t i = 0; i < back->positions.size(); ++i)
            error += std::pow(double{back->positions[i]} - double{source_.positions[i]}, 2);
        EXPECT_LT(error, last_error) << components;
        last_error = error;
    }
}

TEST_F(DecodeVerify, DecodeRefusesMistakes) {
    encode(make_job("a", "sheet.h5"));
    DecodeRequest bad = request("back.h5");
    bad.frame_end = 21;
    EXPECT_EQ(decode(bad).error().code, ErrorCode::kOutOfRange);
    bad = request("back.h5");
    bad.frame_begin = 20;
    EXPECT_EQ(decode(bad).error().code, ErrorCode::kOutOfRange);
    bad = request("sheet.h5");
    EXPECT_EQ(decode(bad).error().code, ErrorCode::kExists);
    bad = request("back.h5");
    bad.output = bad.result;
    bad.overwrite = true;
    EXPECT_EQ(decode(bad).error().code, ErrorCode::kInvalidArgument);
    bad = request("back.h5");
    bad.memory_bytes = 1000;
    EXPECT_EQ(decode(bad).error().code, ErrorCode::kLimit);
    bad = request("back.h5");
    bad.result = folder_ / "sheet.h5";
    EXPECT_EQ(decode(bad).error().code, ErrorCode::kFormat);
    stop_ = true;
    EXPECT_EQ(decode(request("back.h5")).error().code, ErrorCode::kInterrupted);
    EXPECT_FALSE(std::filesystem::exists(folder_ / "back.h5"));
}

TEST_F(DecodeVerify, VerifyAgreesWithTheSource) {
    encode(make_job("a", "sheet.h5", "clips: {length: 7}\n"));
    expect_verified();
}

TEST_F(DecodeVerify, VerifyMeasuresTheDistortionOfEdges) {
    encode(make_job("a", "sheet.h5", "clips: {length: 7}\n"));
    ASSERT_TRUE(decode(request("back.h5")));
    const auto back = read_mesh_sequence(folder_ / "back.h5");
    ASSERT_TRUE(back);
    EdgeDistortionMeter meter(source_.triangles, source_.vertex_count);
    meter.add(source_.view(), back->view(), SerialExecutor());
    const EdgeDistortion expected = meter.finish();
    EXPECT_GT(expected.total, 0.0);
    std::map<std::string, double> found;
    const auto report = verify(folder_ / "sheet.h5");
    ASSERT_TRUE(report);
    for (const VerifiedFigure& figure : report->figures) {
        EXPECT_EQ(figure.is_recorded, !figure.name.starts_with("sted")) << figure.name;
        if (!figure.is_recorded) found[figure.name] = figure.measured;
    }
    EXPECT_EQ(found,
              (std::map<std::string, double>{
                  {"sted", expected.total}, {"sted_space", expected.space}, {"sted_time", expected.time}}));
}

TEST_F(DecodeVerify, VerifyFindsNoEdgesInPoints) {
    source_.triangles.clear();
    write_clip("points.h5", source_);
    encode(parse_job(
               "batchenc: 1\nname: a\ninput: {file: points.h5}\noutput: out/a.h5\ncodec: {method: rtpca}\n",
               folder_ / "a.yaml")
               .value()
               .front());
    const auto report = verify(folder_ / "points.h5");
    ASSERT_TRUE(report) << report.error().to_string();
    EXPECT_TRUE(report->agrees());
    for (const VerifiedFigure& figure : report->figures) EXPECT_TRUE(figure.is_recorded) << figure.name;
}

TEST_F(DecodeVerify, VerifyFindsTheFrameRangeInTheWholeClip) {
    const std::string yaml =
        "batchenc: 1\nname: a\ninput: {file: sheet.h5, frames: [4, 15]}\noutput: out/a.h5\n"
        "segmentation: {clusters: 2}\ncodec: {method: rlpca, components: 3}\n";
    encode(parse_job(yaml, folder_ / "a.yaml").value().front());
    const auto whole = verify(folder_ / "sheet.h5");
    ASSERT_TRUE(whole) << whole.error().to_string();
    EXPECT_TRUE(whole->agrees());
    MeshSequence cut = source_;  // the same frames alone, as a file of their own
    cut.positions.assign(source_.view().at(4, 0), source_.view().at(15, 0));
    cut.frame_count = 11;
    const auto alone = verify(write_clip("cut.h5", cut));
    ASSERT_TRUE(alone) << alone.error().to_string();
    EXPECT_TRUE(alone->agrees());
}

TEST_F(DecodeVerify, VerifyFindsDifferences) {
    encode(make_job("a", "sheet.h5"));
    MeshSequence other = source_;
    other.positions[777] += 0.5F;
    const auto moved = verify(write_clip("moved.h5", other));
    ASSERT_TRUE(moved);
    EXPECT_FALSE(moved->agrees());
    EXPECT_TRUE(moved->same_triangles);
    other = source_;
    std::swap(other.triangles[3], other.triangles[4]);
    const auto reordered = verify(write_clip("reordered.h5", other));
    ASSERT_TRUE(reordered);
    EXPECT_FALSE(reordered->same_triangles);
    EXPECT_FALSE(reordered->agrees());
    EXPECT_EQ(verify(write_clip("small.h5", waving_sheet(20, 5))).error().code, ErrorCode::kVerification);
    EXPECT_EQ(verify(write_clip("short.h5", waving_sheet(19))).error().code, ErrorCode::kVerification);
}

class FreeOrder : public DecodeVerify {
 protected:
    // The sheet in disorder, and two vertices that no triangle has.
    void SetUp() override {
        DecodeVerify::SetUp();
        std::mt19937 generator(1);
        std::erase_if(source_.triangles, [](const Triangle& t) {
            return std::find_if(t.begin(), t.end(), [](std::int32_t v) { return v == 0 || v == 77; }) !=
                   t.end();
        });
        test::shuffle(source_.triangles, generator);
        test::rotate_corners(source_.triangles, generator);
        write_clip("sheet.h5", source_);
    }

    std::map<std::string, double> metrics() const {
        return (*ResultReader::open(output("a")))->metrics().values;
    }

    // Encodes, and compares what comes back with the source in the coder's order.
    void expect_sources_reordered(const Job& job, double largest_error) {
        ASSERT_EQ(job.order, MeshOrder::kFree);
        encode(job);
        DecodeRequest wanted = request("back.h5");
        wanted.overwrite = true;
        ASSERT_TRUE(decode(wanted));
        const auto back = read_mesh_sequence(folder_ / "back.h5");
        ASSERT_TRUE(back) << back.error().to_string();
        const auto coded =
            write_connectivity_bitstream(source_.triangles, source_.vertex_count, MeshOrder::kFree);
        ASSERT_TRUE(coded);
        EXPECT_EQ(back->triangles, coded->triangles);
        EXPECT_NE(back->triangles, source_.triangles);
        auto mapped = back->triangles;
        for (Triangle& t : mapped) {
            for (std::int32_t& v : t) v = coded->source_vertices[static_cast<std::size_t>(v)];
        }
        EXPECT_EQ(test::without_order(mapped), test::without_order(source_.triangles));
        EXPECT_EQ(std::set<std::int32_t>(coded->source_vertices.end() - 2, coded->source_vertices.end()),
                  (std::set<std::int32_t>{0, 77}));
        ASSERT_EQ(back->frame_count, source_.frame_count);
        ASSERT_EQ(back->vertex_count, source_.vertex_count);
        for (std::int64_t f = 0; f < back->frame_count; ++f) {
            for (std::int64_t v = 0; v < back->vertex_count; ++v) {
                const float* is = back->view().at(f, v);
                const float* was = source_.view().at(f, coded->source_vertices[static_cast<std::size_t>(v)]);
                for (int axis = 0; axis < 3; ++axis)
                    ASSERT_NEAR(is[axis], was[axis], largest_error) << f << " " << v;
            }
        }
    }
};

TEST_F(FreeOrder, GivesTheSourceInTheCodersOrder) {
    expect_sources_reordered(make_job("a", "sheet.h5", "order: free\nclips: {length: 7}\n"), 0.05);
    expect_verified();
}

TEST_F(FreeOrder, WorksForTheStaticCoder) {
    const std::string yaml =
        "batchenc: 1\nname: a\ninput: {file: sheet.h5}\noutput: out/a.h5\norder: free\n"
        "codec: {method: static, bits: 12}\n";
    expect_sources_reordered(parse_job(yaml, folder_ / "a.yaml").value().front(), 12.0 / 4096);
    expect_verified();
}

TEST_F(FreeOrder, CostsNothingForTheOrder) {
    encode(make_job("a", "sheet.h5"));
    const auto preserved = metrics();
    EXPECT_GT(preserved.at("bits_order"), 8.0 * 100);
    listener_ = RecordingListener();
    encode(make_job("a", "sheet.h5", "order: free\n"));
    const auto free = metrics();
    EXPECT_EQ(free.at("bits_order"), 0.0);
    EXPECT_LT(free.at("bits_total"), preserved.at("bits_total"));
    EXPECT_NEAR(free.at("bits_connectivity"), preserved.at("bits_connectivity"), 8.0);  // a size of two bytes
}

TEST_F(FreeOrder, LeavesPointsAsTheyAre) {
    source_.triangles.clear();
    write_clip("sheet.h5", source_);
    encode(make_job("a", "sheet.h5", "order: free\n"));
    ASSERT_TRUE(decode(request("back.h5")));
    const auto back = read_mesh_sequence(folder_ / "back.h5");
    ASSERT_TRUE(back) << back.error().to_string();
    for (std::size_t i = 0; i < back->positions.size(); ++i)
        ASSERT_NEAR(back->positions[i], source_.positions[i], 0.05) << i;
    expect_verified();
}

TEST_F(FreeOrder, VerifyFindsDifferences) {
    encode(make_job("a", "sheet.h5", "order: free\n"));
    MeshSequence other = source_;
    other.positions[777] += 0.5F;
    const auto moved = verify(write_clip("moved.h5", other));
    ASSERT_TRUE(moved);
    EXPECT_TRUE(moved->same_triangles);
    EXPECT_FALSE(moved->agrees());
    other = source_;
    std::swap(other.triangles[3][0], other.triangles[3][1]);
    const auto turned = verify(write_clip("turned.h5", other));
    ASSERT_TRUE(turned);
    EXPECT_FALSE(turned->same_triangles);
    EXPECT_FALSE(turned->agrees());
}

}  // namespace
}  // namespace batchenc
