#include "pipeline/result_decoder.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

#include "codecs/clip_codec.h"
#include "codecs/connectivity_bitstream.h"
#include "tests/support/folder_test.h"
#include "tests/support/sample_clips.h"
#include "tests/support/thread_executor.h"

namespace batchenc {
namespace {

constexpr std::int64_t kMemory = std::int64_t{1} << 30;
constexpr std::int64_t kClipFrames = 17;
const SerialExecutor kSerial;

// On executors without oneTBB, so that the thread sanitizer can follow the decoding of a block beside the
// visiting of the one before.
class ResultDecoderTest : public test::FolderTest {
 protected:
    /// Writes a result of clips of kClipFrames frames, and keeps what each of them decodes to by itself.
    /// broken: index of a clip whose bytes are none; -1: every clip is whole.
    void write_result(CodecMethod method, const MeshSequence& clip, std::int64_t broken = -1) {
        ResultHeader header{"rlpca", "name: sheet\n", clip.vertex_count, 0, clip.frame_count, 25.0, "sheet"};
        header.triangle_count = static_cast<std::int64_t>(clip.triangles.size());
        const auto writer = ResultWriter::create(path(), header, true).value();
        if (!clip.triangles.empty()) {
            const auto coded =
                write_connectivity_bitstream(clip.triangles, clip.vertex_count, MeshOrder::kPreserve).value();
            ASSERT_TRUE(writer->write_connectivity(coded.bytes));
        }
        CodecParameters parameters;
        parameters.method = method;
        SegmentationParameters segmentation_parameters;
        segmentation_parameters.clusters = 3;
        expected_.assign(clip.positions.size(), 0.0f);
        for (std::int64_t first = 0; first < clip.frame_count; first += kClipFrames) {
            const std::int64_t count = std::min(kClipFrames, clip.frame_count - first);
            const PositionsView frames(clip.view().at(first, 0), count, clip.vertex_count);
            const auto segmentation =
                segment_clip(frames, clip.triangles, segmentation_parameters, kSerial).value();
            const auto coded =
                encode_clip(frames, clip.triangles, segmentation, parameters, kSerial).value().bitstream;
            const MutablePositionsView out(
                expected_.data() + static_cast<std::size_t>(3 * first * clip.vertex_count), count,
                clip.vertex_count);
            ASSERT_TRUE(decode_clip(coded, clip.triangles, -1, kMemory, kSerial)
                            .value()
                            ->reconstruct(0, out, kSerial));
            const bool is_broken = first / kClipFrames == broken;
            ASSERT_TRUE(
                writer->write_clip({first, count}, is_broken ? std::vector<std::uint8_t>(100, 0xa1) : coded));
        }
        const std::vector<double> of_frames(static_cast<std::size_t>(clip.frame_count), 1.0);
        ASSERT_TRUE(writer->finish({{{"bpvf", 1.0}}, of_frames, of_frames, of_frames}));
    }

    std::filesystem::path path() const { return folder_ / "result.h5"; }

    /// Decodes frames [begin, end); fails where a frame is left out, comes out of turn or differs from what
    /// its clip decodes to by itself.
    void expect_decoded(ResultDecoder& decoder, std::int64_t begin, std::int64_t end,
                        const Executor& executor) {
        visits_ = 0;
        std::int64_t next = begin;
        const auto done = decoder.decode_frames(
            begin, end, -1, executor, [&](std::int64_t first, PositionsView frames) -> Expected<void> {
                EXPECT_EQ(first, next);
                next = first + frames.frame_count();
                ++visits_;
                // A visit has work for the executor itself, as that of verification does.
                std::vector<char> same(static_cast<std::size_t>(frames.frame_count()));
                const std::int64_t size = 3 * frames.vertex_count();
                executor.for_each(frames.frame_count(), [&](std::int64_t f) {
                    same[static_cast<std::size_t>(f)] =
                        std::equal(frames.at(f, 0), frames.at(f, 0) + size,
                                   expected_.data() + static_cast<std::size_t>((first + f) * size));
                });
                for (std::int64_t f = 0; f < frames.frame_count(); ++f)
                    EXPECT_TRUE(same[static_cast<std::size_t>(f)]) << "frame " << first + f;
                return {};
            });
        EXPECT_TRUE(done) << done.error().to_string();
        EXPECT_EQ(next, end);
    }

    std::vector<float> expected_;
    int visits_ = 0;
};

TEST_F(ResultDecoderTest, VisitsEveryFrameInOrderOnAnyExecutor) {
    MeshSequence sheet = test::sheet(9, 8, 60), points = sheet;
    points.triangles.clear();
    const test::ThreadExecutor threads(3);
    for (const CodecMethod method : {CodecMethod::kPdct, CodecMethod::kRlpca, CodecMethod::kStatic}) {
        for (const MeshSequence& clip : {sheet, points}) {
            SCOPED_TRACE(testing::Message()
                         << "method " << static_cast<int>(method) << ", triangles " << clip.triangles.size());
            write_result(method, clip);
            auto decoder = ResultDecoder::open(path(), kMemory).value();
            for (const auto& [begin, end] :
                 {std::pair<std::int64_t, std::int64_t>{0, 60}, {20, 30}, {16, 18}, {59, 60}, {5, 55}}) {
                expect_decoded(decoder, begin, end, threads);
                expect_decoded(decoder, begin, end, kSerial);
                for (const std::uint64_t seed : {1, 2, 3})
                    expect_decoded(decoder, begin, end, ShuffledExecutor(seed));
            }
        }
    }
}

// Little memory makes blocks shorter than clips, which are then decoded further while one is visited.
TEST_F(ResultDecoderTest, BlocksShorterThanAClip) {
    MeshSequence points = test::sheet(20, 20, 60);
    points.triangles.clear();
    write_result(CodecMethod::kRlpca, points);
    auto decoder = ResultDecoder::open(path(), 150000).value();  // blocks of at most 15 frames
    expect_decoded(decoder, 0, 60, test::ThreadExecutor(3));
    EXPECT_EQ(visits_, 7);  // 17 frames in two, three times, and 9 in one
    expect_decoded(decoder, 3, 50, ShuffledExecutor(4));
}

TEST_F(ResultDecoderTest, EndsAtTheFirstErrorOfAVisitAndCanBeAskedAgain) {
    write_result(CodecMethod::kPdct, test::sheet(9, 8, 60));
    auto decoder = ResultDecoder::open(path(), kMemory).value();
    for (int good = 0; good < 4; ++good) {
        const test::ThreadExecutor threads(3);
        int visits = 0;
        const auto done =
            decoder.decode_frames(0, 60, -1, threads, [&](std::int64_t, PositionsView) -> Expected<void> {
                if (visits++ == good) return fail(ErrorCode::kIo, "the disk is full");
                return {};
            });
        ASSERT_FALSE(done);
        EXPECT_EQ(done.error().code, ErrorCode::kIo);
        EXPECT_EQ(visits, good + 1);
        expect_decoded(decoder, 0, 60, threads);  // and nothing is left over of the call before
    }
}

TEST_F(ResultDecoderTest, AVisitThatThrowsLeavesNothingBehind) {
    write_result(CodecMethod::kPdct, test::sheet(9, 8, 60));
    auto decoder = ResultDecoder::open(path(), kMemory).value();
    EXPECT_THROW(static_cast<void>(decoder.decode_frames(
                     0, 60, -1, kSerial, [](std::int64_t, PositionsView) -> Expected<void> { throw 1; })),
                 int);
    expect_decoded(decoder, 0, 60, kSerial);
}

TEST_F(ResultDecoderTest, GivesWhatComesBeforeABrokenClip) {
    const MeshSequence clip = test::sheet(9, 8, 60);
    for (const std::int64_t broken : {0, 1, 3}) {
        write_result(CodecMethod::kPdct, clip, broken);
        auto decoder = ResultDecoder::open(path(), kMemory).value();
        std::int64_t visited = 0;
        for (int time = 0; time < 2; ++time) {
            visited = 0;
            const auto done =
                decoder.decode_frames(0, 60, -1, test::ThreadExecutor(3),
                                      [&](std::int64_t first, PositionsView frames) -> Expected<void> {
                                          EXPECT_EQ(first, visited);
                                          visited += frames.frame_count();
                                          return {};
                                      });
            ASSERT_FALSE(done);
            EXPECT_EQ(done.error().code, ErrorCode::kFormat) << done.error().to_string();
            EXPECT_EQ(visited, broken * kClipFrames);
        }
        if (broken == 0) expect_decoded(decoder, kClipFrames, 60, kSerial);
    }
}

}  // namespace
}  // namespace batchenc
