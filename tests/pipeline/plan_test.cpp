#include "pipeline/plan.h"

#include "pipeline/clip_cutting.h"

#include "tests/pipeline/batch_fixture.h"

namespace batchenc {
namespace {

class Plan : public BatchTest {
 protected:
    JobPlan plan(const Job& job, ExistingOutput existing = ExistingOutput::kRefuse) const {
        return plan_jobs({job}, existing, stop_).front();
    }
    static ErrorCode code_of(const Expected<void>& checked) {
        return checked ? ErrorCode::kInternal : checked.error().code;
    }
};

TEST_F(Plan, CutsTheFrameRangeIntoClips) {
    write_clip("sheet.h5", waving_sheet(23));
    Job job = make_job("a", "sheet.h5", "clips: {length: 8}\n");
    job.frame_begin = 2;
    const JobPlan planned = plan(job);
    ASSERT_FALSE(planned.error) << planned.error->to_string();
    EXPECT_EQ(planned.header.frame_count, 21);
    EXPECT_EQ(planned.header.vertex_count, 144);
    EXPECT_EQ(planned.header.triangle_count, 242);
    EXPECT_EQ(planned.header.fps, 25.0);
    EXPECT_EQ(planned.header.job, job.yaml);
    const auto clips = planned.even_clips();
    ASSERT_EQ(clips.size(), 3U);
    EXPECT_EQ(clips[0].first_frame, 0);
    EXPECT_EQ(clips[1].first_frame, 8);
    EXPECT_EQ(clips[2].first_frame, 16);
    EXPECT_EQ(clips[2].frame_count, 5);
    EXPECT_EQ(planned.raw_bytes(), 12 * 144 * 21);
}

TEST_F(Plan, OneClipByDefaultAndWhenTheLengthIsMore) {
    write_clip("sheet.h5", waving_sheet(5));
    EXPECT_EQ(plan(make_job("a", "sheet.h5")).even_clips().size(), 1U);
    EXPECT_EQ(plan(make_job("a", "sheet.h5", "clips: {length: 99}\n")).even_clips()[0].frame_count, 5);
}

TEST_F(Plan, LeavesAutomaticClipsToTheJobsBeginning) {
    write_clip("sheet.h5", waving_sheet(40));
    const JobPlan planned = plan(make_job("a", "sheet.h5", "clips: {length: auto}\n"));
    EXPECT_TRUE(planned.cuts_by_motion);
    EXPECT_EQ(planned.clip_length, 40);
    EXPECT_EQ(clip_memory_bytes(planned), clip_memory_bytes(plan(make_job("b", "sheet.h5"))));
    EXPECT_EQ(longest_automatic_clip(CodecMethod::kRlpca, 3), 4096);
    EXPECT_EQ(longest_automatic_clip(CodecMethod::kRlpca, 200000), 83);
    EXPECT_EQ(longest_automatic_clip(CodecMethod::kRlpca, 1 << 28), 32);
    EXPECT_EQ(longest_automatic_clip(CodecMethod::kStatic, 200000), 13);
    EXPECT_EQ(longest_automatic_clip(CodecMethod::kStatic, 1 << 28), 1);
    const std::string by_frames = "clips: {length: auto}\nsweep: {codec.method: [static]}\n";
    EXPECT_FALSE(plan(make_job("c", "sheet.h5", by_frames)).cuts_by_motion);
    // A coder of clusters without components: long clips, which save first frames.
    const std::string by_transforms = "clips: {length: auto}\nsweep: {codec.method: [pdct]}\n";
    EXPECT_FALSE(plan(make_job("d", "sheet.h5", by_transforms)).cuts_by_motion);
    EXPECT_EQ(longest_automatic_clip(CodecMethod::kPdct, 200000), 83);
}

TEST_F(Plan, RefusesFramesThatTheClipDoesNotHave) {
    write_clip("sheet.h5", waving_sheet(5));
    Job job = make_job("a", "sheet.h5");
    job.frame_end = 6;
    ASSERT_TRUE(plan(job).error);
    EXPECT_EQ(plan(job).error->code, ErrorCode::kOutOfRange);
    job.frame_end = std::nullopt;
    job.frame_begin = 5;
    ASSERT_TRUE(plan(job).error);
    EXPECT_EQ(plan(job).error->code, ErrorCode::kOutOfRange);
}

TEST_F(Plan, NamesAMissingInput) {
    const JobPlan planned = plan(make_job("a", "nowhere.h5"));
    ASSERT_TRUE(planned.error);
    EXPECT_EQ(planned.error->code, ErrorCode::kIo);
    EXPECT_NE(planned.error->to_string().find("nowhere.h5"), std::string::npos);
}

TEST_F(Plan, RefusesAnExistingOutputUnlessTold) {
    write_clip("sheet.h5", waving_sheet(5));
    const Job job = make_job("a", "sheet.h5");
    std::filesystem::create_directories(folder_ / "out");
    std::ofstream(output("a")) << "not a result";
    ASSERT_TRUE(plan(job).error);
    EXPECT_EQ(plan(job).error->code, ErrorCode::kExists);
    EXPECT_TRUE(plan(job, ExistingOutput::kReplace).runs());
    EXPECT_TRUE(plan(job, ExistingOutput::kResume).runs());  // what is there is not a result
}

TEST_F(Plan, RefusesTwoJobsWithOneOutput) {
    Job a = make_job("a", "sheet.h5"), b = make_job("b", "sheet.h5");
    EXPECT_TRUE(check_outputs({a, b}));
    b.output = folder_ / "out" / ".." / "out" / "a.h5";
    EXPECT_EQ(code_of(check_outputs({a, b})), ErrorCode::kInvalidArgument);
    std::filesystem::create_directories(folder_ / "out");
    std::filesystem::create_directory_symlink(folder_ / "out", folder_ / "alias");
    b.output = folder_ / "alias" / "a.h5";
    EXPECT_EQ(code_of(check_outputs({a, b})), ErrorCode::kInvalidArgument);
}

TEST_F(Plan, RefusesAnOutputThatIsAnInput) {
    write_clip("sheet.h5", waving_sheet(2));
    write_clip("other.h5", waving_sheet(2));
    Job a = make_job("a", "sheet.h5");
    a.output = folder_ / "." / "sheet.h5";
    EXPECT_EQ(code_of(check_outputs({a})), ErrorCode::kInvalidArgument);
    a.output = folder_ / "other.h5";
    EXPECT_TRUE(check_outputs({a}));
    EXPECT_EQ(code_of(check_outputs({a, make_job("b", "other.h5")})), ErrorCode::kInvalidArgument);
}

TEST_F(Plan, TokensFollowTheMemory) {
    write_clip("sheet.h5", waving_sheet(40));
    const std::vector<JobPlan> plans = {plan(make_job("a", "sheet.h5")),
                                        plan(make_job("b", "sheet.h5", "clips: {length: 10}\n"))};
    const std::int64_t largest = clip_memory_bytes(plans[0]);
    EXPECT_GE(largest, 2 * 12 * 144 * 40);  // source and decoded at the very least
    EXPECT_GT(largest, clip_memory_bytes(plans[1]));
    JobPlan baseline = plans[0];  // keeps points, residuals and symbols of all frames
    baseline.job.codec.method = CodecMethod::kBaselineDynapack;
    EXPECT_GE(clip_memory_bytes(baseline) - largest, 4 * 12 * 144 * 40);
    EXPECT_EQ(choose_tokens(plans, 1, 4), 1);
    EXPECT_EQ(choose_tokens(plans, 3 * largest, 4), 3);
    EXPECT_EQ(choose_tokens(plans, 1000 * largest, 4), 8);
}

TEST_F(Plan, StopsOnRequest) {
    write_clip("sheet.h5", waving_sheet(2));
    stop_ = true;
    const JobPlan planned = plan(make_job("a", "sheet.h5"));
    ASSERT_TRUE(planned.error);
    EXPECT_EQ(planned.error->code, ErrorCode::kInterrupted);
}

}  // namespace
}  // namespace batchenc
