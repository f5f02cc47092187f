#include "pipeline/clip_graph.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <thread>
#include <vector>

#include "pipeline/clip_in_flight.h"
#include "pipeline/threads.h"

namespace batchenc {
namespace {

/// Stages that do nothing but watch: how many clips are in flight, in which order they are written.
struct Watcher {
    std::int64_t clip_count;
    std::int64_t next_number = 0;
    std::atomic<int> in_flight = 0;
    std::atomic<int> most_in_flight = 0;
    std::atomic<int> reading = 0;
    std::atomic<int> writing = 0;
    std::atomic<bool> overlapped = false;  // two reads at once, or two writes
    std::vector<std::int64_t> written;
    std::vector<int> visits;  // of segment, code and verify, by clip

    explicit Watcher(std::int64_t count) : clip_count(count), visits(static_cast<std::size_t>(count)) {}

    static void work(std::int64_t number) {
        std::this_thread::sleep_for(std::chrono::microseconds((number * 7919) % 400));
    }

    ClipStages stages() {
        ClipStages stages;
        stages.next = [this]() -> std::shared_ptr<ClipInFlight> {
            if (next_number == clip_count) return nullptr;
            auto clip = std::make_shared<ClipInFlight>();
            clip->number = next_number++;
            return clip;
        };
        stages.read = [this](ClipInFlight& clip) {
            if (reading++ > 0) overlapped = true;
            const int now = ++in_flight;
            int most = most_in_flight;
            while (now > most && !most_in_flight.compare_exchange_weak(most, now)) {
            }
            work(clip.number);
            --reading;
        };
        const auto pass = [this](ClipInFlight& clip) {
            work(clip.number + 1);
            ++visits[static_cast<std::size_t>(clip.number)];
        };
        stages.segment = pass;
        stages.code = pass;
        stages.verify = pass;
        stages.write = [this](ClipInFlight& clip) {
            if (writing++ > 0) overlapped = true;
            written.push_back(clip.number);
            --in_flight;
            --writing;
        };
        return stages;
    }
};

class ClipGraph : public testing::TestWithParam<int> {};

TEST_P(ClipGraph, WritesEveryClipInOrderWithinItsTokens) {
    const int tokens = GetParam();
    for (const int threads : {1, 2, 4}) {
        Watcher watcher(150);
        run_with_threads(threads, [&] { run_clip_graph(watcher.stages(), tokens); });
        std::vector<std::int64_t> all(150);
        for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<std::int64_t>(i);
        EXPECT_EQ(watcher.written, all);
        EXPECT_EQ(watcher.visits, std::vector<int>(150, 3));
        EXPECT_LE(watcher.most_in_flight, tokens);
        EXPECT_FALSE(watcher.overlapped);
        EXPECT_EQ(watcher.in_flight, 0);
        if (threads > 1 && tokens > 1) {
            EXPECT_GT(watcher.most_in_flight, 1);
        }
    }
}

INSTANTIATE_TEST_SUITE_P(Tokens, ClipGraph, testing::Values(1, 2, 3, 8));

TEST(ClipGraphWithoutClips, Ends) {
    Watcher watcher(0);
    run_clip_graph(watcher.stages(), 2);
    EXPECT_TRUE(watcher.written.empty());
}

}  // namespace
}  // namespace batchenc
