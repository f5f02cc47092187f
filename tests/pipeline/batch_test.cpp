#include "pipeline/batch.h"

#include <limits>

#include "pipeline/tbb_executor.h"
#include "pipeline/threads.h"
#include "tests/pipeline/batch_fixture.h"

namespace batchenc {
namespace {

class Batch : public BatchTest {
 protected:
    BatchReport run(const std::vector<Job>& jobs, ExistingOutput existing, int threads,
                    const Executor& executor) {
        const auto plans = plan_jobs(jobs, existing, stop_);
        BatchReport report;
        run_with_threads(threads, [&] {
            report = run_batch(plans, {1LL << 30, threads}, executor, stop_, listener_);
        });
        EXPECT_EQ(report.jobs.size(), jobs.size());
        EXPECT_EQ(listener_.ended.size(), jobs.size());
        listener_ = RecordingListener();
        return report;
    }
    BatchReport run(const std::vector<Job>& jobs, ExistingOutput existing = ExistingOutput::kRefuse,
                    int threads = 2) {
        return run(jobs, existing, threads, TbbExecutor(stop_));
    }

    /// Everything in a result that its decoder reads, and every metric but the times.
    std::vector<std::uint8_t> content(const std::string& name) const {
        auto reader = ResultReader::open(output(name));
        EXPECT_TRUE(reader) << reader.error().to_string();
        if (!reader) return {};
        std::vector<std::uint8_t> bytes = (*reader)->read_connectivity().value();
        for (std::size_t i = 0; i < (*reader)->clips().size(); ++i) {
            const auto clip = (*reader)->read_clip(static_cast<std::int64_t>(i)).value();
            bytes.insert(bytes.end(), clip.begin(), clip.end());
        }
        for (const auto& [metric, value] : (*reader)->metrics().values) {
            if (metric.ends_with("_time_s")) continue;
            const auto* raw = reinterpret_cast<const std::uint8_t*>(&value);
            bytes.insert(bytes.end(), raw, raw + sizeof(value));
        }
        return bytes;
    }
};

TEST_F(Batch, WritesResultsWhoseFiguresAddUp) {
    write_clip("sheet.h5", waving_sheet(20));
    const BatchReport report = run({make_job("a", "sheet.h5", "clips: {length: 6}\n")});
    ASSERT_TRUE(report.all_done()) << report.jobs[0].error->to_string();
    auto reader = ResultReader::open(output("a"));
    ASSERT_TRUE(reader) << reader.error().to_string();
    EXPECT_EQ((*reader)->clips().size(), 4U);
    const auto& metrics = (*reader)->metrics().values;
    EXPECT_EQ(metrics, report.jobs[0].metrics.values);
    double sections = 0.0;
    for (const char* name : {"bits_connectivity", "bits_order", "bits_segmentation", "bits_frames",
                             "bits_basis", "bits_coefficients", "bits_residuals", "bits_headers"})
        sections += metrics.at(name);
    EXPECT_EQ(sections, metrics.at("bits_total"));
    std::size_t bytes = (*reader)->read_connectivity()->size(), clip_bytes = 0;
    for (std::int64_t i = 0; i < 4; ++i) clip_bytes += (*reader)->read_clip(i)->size();
    bytes += clip_bytes;
    EXPECT_EQ(metrics.at("bits_total"), 8.0 * static_cast<double>(bytes));
    EXPECT_DOUBLE_EQ(metrics.at("bpvf"), 8.0 * static_cast<double>(bytes) / (144.0 * 20.0));
    EXPECT_DOUBLE_EQ(metrics.at("bpvf_geometry"), 8.0 * static_cast<double>(clip_bytes) / (144.0 * 20.0));
    EXPECT_GT(metrics.at("encode_time_s"), 0.0);
    EXPECT_GT(metrics.at("decode_time_s"), 0.0);
    EXPECT_EQ((*reader)->metrics().frame_rmse.size(), 20U);
    EXPECT_EQ(report.jobs[0].raw_bytes, 12 * 144 * 20);
    EXPECT_EQ(report.jobs[0].result_bytes,
              static_cast<std::int64_t>(std::filesystem::file_size(output("a"))));
    const StageSeconds& seconds = report.jobs[0].seconds;
    for (const double time : {seconds.read, seconds.segment, seconds.code, seconds.verify, seconds.write})
        EXPECT_GT(time, 0.0);
}

TEST_F(Batch, WritesTheSameBytesForAnyThreadsAndAnyOrder) {
    write_clip("a.h5", waving_sheet(30));
    write_clip("b.h5", waving_sheet(9, 20));
    const std::vector<Job> jobs = {make_job("a", "a.h5", "clips: {length: 7}\n"), make_job("b", "b.h5"),
                                   make_job("c", "a.h5", "clips: {length: 7}\norder: free\n")};
    ASSERT_TRUE(run(jobs, ExistingOutput::kReplace, 1).all_done());
    const auto a = content("a"), b = content("b"), c = content("c");
    ASSERT_FALSE(a.empty());
    for (const int threads : {2, 5}) {
        ASSERT_TRUE(run(jobs, ExistingOutput::kReplace, threads).all_done());
        EXPECT_EQ(content("a"), a) << threads << " threads";
        EXPECT_EQ(content("b"), b) << threads << " threads";
        EXPECT_EQ(content("c"), c) << threads << " threads";
    }
    for (std::uint64_t seed = 0; seed < 10; ++seed) {
        ASSERT_TRUE(run(jobs, ExistingOutput::kReplace, 2, ShuffledExecutor(seed)).all_done());
        EXPECT_EQ(content("a"), a) << "order " << seed;
        EXPECT_EQ(content("b"), b) << "order " << seed;
        EXPECT_EQ(content("c"), c) << "order " << seed;
    }
}

TEST_F(Batch, CutsWhereTheMotionChanges) {
    write_clip("acts.h5", changing_sheet(600, 200));
    const std::vector<Job> jobs = {make_job("a", "acts.h5", "clips: {length: auto}\n"),
                                   make_job("s", "acts.h5", "clips: {length: auto}\n")};
    ASSERT_TRUE(run(jobs, ExistingOutput::kReplace, 1).all_done());
    const auto a = content("a");
    const auto reader = ResultReader::open(output("a"));
    ASSERT_TRUE(reader) << reader.error().to_string();
    ASSERT_EQ((*reader)->clips().size(), 3U);
    EXPECT_NEAR(static_cast<double>((*reader)->clips()[1].first_frame), 200.0, 16.0);
    EXPECT_NEAR(static_cast<double>((*reader)->clips()[2].first_frame), 400.0, 16.0);
    for (const int threads : {2, 5}) {
        ASSERT_TRUE(run(jobs, ExistingOutput::kReplace, threads).all_done());
        EXPECT_EQ(content("a"), a) << threads << " threads";
    }
    ASSERT_TRUE(run(jobs, ExistingOutput::kReplace, 2, ShuffledExecutor(3)).all_done());
    EXPECT_EQ(content("a"), a);
    for (const JobReport& job : run(jobs, ExistingOutput::kResume).jobs) EXPECT_TRUE(job.kept);
}

TEST_F(Batch, LookingForCutsFailsAndStopsLikeAStage) {
    MeshSequence broken = waving_sheet(40);
    broken.positions[3 * 144 * 35] = std::numeric_limits<float>::quiet_NaN();
    write_clip("broken.h5", broken);
    write_clip("good.h5", waving_sheet(40));
    const std::string more = "clips: {length: auto}\n";
    const BatchReport report = run({make_job("a", "broken.h5", more), make_job("b", "good.h5", more)});
    ASSERT_TRUE(report.jobs[0].error);
    EXPECT_EQ(report.jobs[0].error->code, ErrorCode::kNotFinite);
    EXPECT_FALSE(report.jobs[1].error);
    EXPECT_EQ(written_files(), std::vector<std::string>{"b.h5"});
    double last = 0.0;
    listener_.on_progress = [&] { last = listener_.last_progress; };
    run({make_job("c", "good.h5", more), make_job("d", "good.h5")});
    EXPECT_EQ(last, 1.0);
    listener_.on_progress = [&] { stop_ = true; };
    EXPECT_TRUE(run({make_job("e", "good.h5", more), make_job("f", "good.h5", more)}).interrupted());
    EXPECT_EQ(written_files(), (std::vector<std::string>{"b.h5", "c.h5", "d.h5"}));
}

/// No coder carries anything over a seam: a clip is what its frames alone would be, bit for bit, and so are
/// its errors.
class Seams : public Batch, public testing::WithParamInterface<const char*> {};

TEST_P(Seams, CarryNothingOver) {
    write_clip("acts.h5", changing_sheet(60, 25));
    const std::string coder = GetParam();
    const std::string method = "codec: {method: " + coder + ", components: 4" +
                               (coder == "orlpca" ? ", target: {components: 9}" : "") + "}\n";
    const auto job = [&](const std::string& name, const std::string& frames, const std::string& more) {
        const std::string yaml = "batchenc: 1\nname: " + name + "\ninput: {file: acts.h5, frames: " + frames +
                                 "}\noutput: out/" + name + ".h5\nsegmentation: {clusters: 3}\n" + method +
                                 more;
        return parse_job(yaml, folder_ / (name + ".yaml")).value().front();
    };
    ASSERT_TRUE(run({job("whole", "[0, 60]", "clips: {length: 24}\n"), job("p0", "[0, 24]", ""),
                     job("p1", "[24, 48]", ""), job("p2", "[48, 60]", "")})
                    .all_done());
    auto whole = ResultReader::open(output("whole")).value();
    ASSERT_EQ(whole->clips().size(), 3U);
    for (std::int64_t i = 0; i < 3; ++i) {
        auto part = ResultReader::open(output("p" + std::to_string(i))).value();
        EXPECT_EQ(whole->read_clip(i).value(), part->read_clip(0).value()) << i;
        const auto first = static_cast<std::size_t>(24 * i);
        EXPECT_EQ(whole->metrics().frame_rmse[first], part->metrics().frame_rmse[0]) << i;
        EXPECT_EQ(whole->metrics().frame_max_error[first], part->metrics().frame_max_error[0]) << i;
        EXPECT_EQ(part->metrics().frame_jump[0], 0.0);
        EXPECT_EQ(part->metrics().values.at("seam_jump_max"), 0.0);
        EXPECT_EQ(whole->metrics().frame_jump[first + 1], part->metrics().frame_jump[1]) << i;
    }
    const auto& jumps = whole->metrics().frame_jump;
    ASSERT_EQ(jumps.size(), 60U);
    EXPECT_GT(jumps[24], 0.0);
    const auto& values = whole->metrics().values;
    EXPECT_EQ(values.at("seam_jump_max"), std::max(jumps[24], jumps[48]));
    EXPECT_DOUBLE_EQ(values.at("seam_jump_mean"), 0.5 * (jumps[24] + jumps[48]));
    double inner = 0.0, sum = 0.0;
    for (std::size_t f = 1; f < 60; ++f) {
        if (f % 24 == 0) continue;
        inner = std::max(inner, jumps[f]);
        sum += jumps[f];
    }
    EXPECT_EQ(values.at("inner_jump_max"), inner);
    EXPECT_DOUBLE_EQ(values.at("inner_jump_mean"), sum / 57.0);
}

INSTANTIATE_TEST_SUITE_P(Coders, Seams, testing::Values("rlpca", "static", "orlpca"));

/// Targets are those of the whole result: of all clips together, connectivity and order counted.
TEST_F(Batch, KeepsTargetsOverClips) {
    write_clip("acts.h5", changing_sheet(96, 32));
    MeshSequence points = changing_sheet(48, 20);
    points.triangles.clear();
    write_clip("points.h5", points);
    struct Case {
        const char *input, *clips, *target;
        double value;
    };
    int number = 0;
    for (const Case& c :
         {Case{"acts.h5", "{length: 0}", "da", 2.0}, Case{"acts.h5", "{length: 30}", "da", 2.0},
          Case{"acts.h5", "{length: auto}", "da", 1.0}, Case{"acts.h5", "{length: 30}", "kg", 0.4},
          Case{"acts.h5", "{length: 0}", "bpvf", 6.0}, Case{"acts.h5", "{length: 30}", "bpvf", 9.0},
          Case{"points.h5", "{length: 20}", "bpvf", 9.0}, Case{"points.h5", "{length: 20}", "da", 2.0}}) {
        for (const char* order : {"preserve", "free"}) {
            const std::string name = "t" + std::to_string(number++);
            const std::string yaml =
                "batchenc: 1\nname: " + name + "\ninput: {file: " + c.input + "}\noutput: out/" + name +
                ".h5\nclips: " + c.clips + "\norder: " + order +
                "\nsegmentation: {clusters: 3}\ncodec: {method: orlpca, basis_bits: 14, target: {" +
                c.target + ": " + std::to_string(c.value) + "}}\n";
            const auto jobs = parse_job(yaml, folder_ / (name + ".yaml"));
            ASSERT_TRUE(jobs) << jobs.error().to_string();
            EXPECT_EQ(jobs->front().codec.components, kDefaultMostComponents);
            const BatchReport report = run(*jobs);
            ASSERT_TRUE(report.all_done()) << report.jobs[0].error->to_string() << "\n" << yaml;
            const double reached = report.jobs[0].metrics.values.at(c.target);
            EXPECT_LE(reached, c.value * (1.0 + 1e-9)) << yaml;
            EXPECT_GE(reached, 0.7 * c.value) << yaml;
        }
    }
}

TEST_F(Batch, FailsWhereATargetIsBeyondReach) {
    write_clip("sheet.h5", waving_sheet(20));
    const auto error_of = [&](const std::string& target) {
        const auto jobs = parse_job(
            "batchenc: 1\nname: a\ninput: {file: sheet.h5}\noutput: out/a.h5\n"
            "segmentation: {clusters: 3}\ncodec: {method: orlpca, target: {" +
                target + "}}\n",
            folder_ / "a.yaml");
        const BatchReport report = run(jobs.value());
        EXPECT_TRUE(report.jobs[0].error);
        EXPECT_TRUE(written_files().empty());
        return report.jobs[0].error ? report.jobs[0].error->message : std::string();
    };
    EXPECT_NE(error_of("bpvf: 0.001").find("connectivity alone"), std::string::npos);
    EXPECT_NE(error_of("bpvf: 0.5").find("without any component"), std::string::npos);
    EXPECT_NE(error_of("da: 1e-9").find("beyond reach"), std::string::npos);
}

TEST_F(Batch, GoesOnAfterAFailedJob) {
    write_clip("good.h5", waving_sheet(12));
    MeshSequence broken = waving_sheet(40);
    broken.positions[3 * 144 * 20 + 5] =
        std::numeric_limits<float>::quiet_NaN();  // in the third clip of five
    write_clip("broken.h5", broken);
    std::ofstream(folder_ / "file") << "no folder";
    Job nowhere_to_write = make_job("d", "good.h5");
    nowhere_to_write.output = folder_ / "file" / "d.h5";
    const BatchReport report = run(
        {make_job("a", "good.h5"), make_job("b", "broken.h5", "clips: {length: 8}\n"),
         make_job("c", "missing.h5"), nowhere_to_write, make_job("e", "good.h5", "clips: {length: 3}\n")});
    EXPECT_FALSE(report.all_done());
    EXPECT_FALSE(report.interrupted());
    EXPECT_FALSE(report.jobs[0].error);
    ASSERT_TRUE(report.jobs[1].error);
    EXPECT_EQ(report.jobs[1].error->code, ErrorCode::kNotFinite);
    ASSERT_TRUE(report.jobs[2].error);
    EXPECT_EQ(report.jobs[2].error->code, ErrorCode::kIo);
    ASSERT_TRUE(report.jobs[3].error);
    EXPECT_EQ(report.jobs[3].error->code, ErrorCode::kIo);
    EXPECT_FALSE(report.jobs[4].error);
    EXPECT_EQ(written_files(), (std::vector<std::string>{"a.h5", "e.h5"}));
}

TEST_F(Batch, ResumeKeepsWhatIsWholeAndTheSame) {
    write_clip("sheet.h5", waving_sheet(6));
    const std::vector<Job> jobs = {make_job("same", "sheet.h5"), make_job("other", "sheet.h5"),
                                   make_job("broken", "sheet.h5"), make_job("new", "sheet.h5")};
    ASSERT_TRUE(run({jobs[0], jobs[1], jobs[2]}).all_done());
    std::filesystem::resize_file(output("broken"), std::filesystem::file_size(output("broken")) / 2);
    std::vector<Job> again = jobs;
    again[1] = make_job("other", "sheet.h5", "clips: {length: 3}\n");

    const auto old_time = std::filesystem::last_write_time(output("same"));
    const BatchReport report = run(again, ExistingOutput::kResume);
    ASSERT_TRUE(report.all_done());
    EXPECT_TRUE(report.jobs[0].kept);
    EXPECT_GT(report.jobs[0].metrics.values.at("bits_total"), 0.0);
    for (const std::size_t i : {1U, 2U, 3U}) EXPECT_FALSE(report.jobs[i].kept) << i;
    EXPECT_EQ(std::filesystem::last_write_time(output("same")), old_time);
    EXPECT_EQ(ResultReader::open(output("other")).value()->clips().size(), 2U);
    EXPECT_TRUE(ResultReader::open(output("broken")));

    write_clip("sheet.h5", waving_sheet(7));  // another shape: nothing that is there fits
    for (const JobReport& job : run(again, ExistingOutput::kResume).jobs) EXPECT_FALSE(job.kept);
}

TEST_F(Batch, LeavesAnExistingOutputAloneUnlessTold) {
    write_clip("sheet.h5", waving_sheet(6));
    ASSERT_TRUE(run({make_job("a", "sheet.h5")}).all_done());
    const auto before = content("a");
    write_clip("sheet.h5", waving_sheet(8));
    const BatchReport refused = run({make_job("a", "sheet.h5")});
    ASSERT_TRUE(refused.jobs[0].error);
    EXPECT_EQ(refused.jobs[0].error->code, ErrorCode::kExists);
    EXPECT_EQ(content("a"), before);
    ASSERT_TRUE(run({make_job("a", "sheet.h5")}, ExistingOutput::kReplace).all_done());
    EXPECT_NE(content("a"), before);
}

TEST_F(Batch, StopLeavesNothingHalfWritten) {
    write_clip("sheet.h5", waving_sheet(60));
    std::vector<Job> jobs;
    for (const char* name : {"a", "b", "c"})
        jobs.push_back(make_job(name, "sheet.h5", "clips: {length: 2}\n"));
    listener_.on_progress = [this] {
        if (listener_.last_progress > 0.4) stop_ = true;  // in the midst of the second job
    };
    const BatchReport report = run(jobs);
    EXPECT_TRUE(report.interrupted());
    EXPECT_FALSE(report.jobs[0].error);
    for (const std::size_t i : {1U, 2U}) {
        ASSERT_TRUE(report.jobs[i].error);
        EXPECT_EQ(report.jobs[i].error->code, ErrorCode::kInterrupted);
    }
    EXPECT_EQ(written_files(), std::vector<std::string>{"a.h5"});
}

TEST_F(Batch, ProgressEndsAtOne) {
    write_clip("sheet.h5", waving_sheet(10));
    double last = 0.0;
    listener_.on_progress = [&] { last = listener_.last_progress; };
    run({make_job("a", "sheet.h5", "clips: {length: 3}\n"), make_job("b", "missing.h5")});
    EXPECT_EQ(last, 1.0);
}

TEST_F(Batch, EncodesPointsAndOneFrameAndOneTriangle) {
    MeshSequence points = waving_sheet(6);
    points.triangles.clear();
    write_clip("points.h5", points);
    write_clip("frame.h5", waving_sheet(1));
    MeshSequence triangle;
    triangle.frame_count = 2;
    triangle.vertex_count = 3;
    triangle.triangles = {{0, 1, 2}};
    triangle.positions = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 0, 1, 0, 1, 2};
    write_clip("triangle.h5", triangle);
    const BatchReport report = run({make_job("points", "points.h5"), make_job("frame", "frame.h5"),
                                    make_job("triangle", "triangle.h5")});
    for (const JobReport& job : report.jobs) EXPECT_FALSE(job.error) << job.error->to_string();
    EXPECT_EQ(report.jobs[0].metrics.values.at("bits_connectivity"), 0.0);
}

}  // namespace
}  // namespace batchenc
