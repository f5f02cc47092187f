#include "pipeline/tbb_executor.h"

#include <gtest/gtest.h>

#include <chrono>
#include <mutex>
#include <set>
#include <stdexcept>
#include <thread>
#include <vector>

#include "pipeline/threads.h"

namespace batchenc {
namespace {

const std::atomic<bool> kNoStop = false;

TEST(TbbExecutor, CallsEveryIndexOnce) {
    std::vector<int> calls(1000);
    run_with_threads(4, [&] {
        TbbExecutor(kNoStop).for_each(1000, [&](std::int64_t i) { ++calls[static_cast<std::size_t>(i)]; });
    });
    EXPECT_EQ(calls, std::vector<int>(1000, 1));
}

TEST(TbbExecutor, DoesNothingForNoIndices) {
    TbbExecutor(kNoStop).for_each(0, [](std::int64_t) { FAIL(); });
}

TEST(TbbExecutor, PassesExceptionsOn) {
    const auto fail_at_seven = [](std::int64_t i) {
        if (i == 7) throw std::runtime_error("seven");
    };
    EXPECT_THROW(TbbExecutor(kNoStop).for_each(100, fail_at_seven), std::runtime_error);
}

TEST(TbbExecutor, StopsOnRequest) {
    std::atomic<bool> stop = false;
    std::atomic<int> calls = 0;
    const auto stop_at_once = [&](std::int64_t) {
        ++calls;
        stop = true;
    };
    run_with_threads(2, [&] { EXPECT_THROW(TbbExecutor(stop).for_each(100000, stop_at_once), Interrupted); });
    EXPECT_LT(calls, 100);
}

/// Waits until the condition holds; false after ten seconds.
template <typename Condition>
bool await(Condition condition) {
    for (int i = 0; i < 100000; ++i) {
        if (condition()) return true;
        std::this_thread::sleep_for(std::chrono::microseconds(100));
    }
    return false;
}

// While a thread waits for the rest of its own loop it must not take up parts of another: in the graph that
// would be a stage inside a stage. One thread waits, one keeps it waiting, and one offers work.
TEST(TbbExecutor, AWaitingThreadTakesUpNoOtherLoop) {
    std::atomic<int> present = 0, in_first_loop = 0, taken_by_waiting_thread = 0;
    std::atomic<bool> is_waiting = false, is_over = false;
    run_with_threads(3, [&] {
        const TbbExecutor executor(kNoStop);
        executor.for_each(3, [&](std::int64_t role) {
            thread_local bool waits = false;
            ++present;
            ASSERT_TRUE(await([&] { return present == 3; })) << "three threads are needed";
            if (role == 0) {
                waits = true;
                executor.for_each(2, [&](std::int64_t) {
                    ++in_first_loop;
                    ASSERT_TRUE(await([&] { return in_first_loop == 2; }));
                    if (waits)
                        is_waiting = true;
                    else
                        ASSERT_TRUE(await([&] { return is_over.load(); }));
                });
                waits = false;
            }
            if (role == 2) {
                ASSERT_TRUE(await([&] { return is_waiting.load(); }));
                executor.for_each(20, [&](std::int64_t) {
                    std::this_thread::sleep_for(std::chrono::milliseconds(2));
                    if (waits) ++taken_by_waiting_thread;
                });
                is_over = true;
            }
        });
    });
    EXPECT_EQ(taken_by_waiting_thread, 0);
}

// One part of a loop throws while another is inside a loop of its own: what comes after that one must not run
// with indices left out.
TEST(TbbExecutor, AnInnerLoopNeverReturnsWithIndicesLeftOut) {
    constexpr int kCount = 4000;
    std::atomic<int> calls = 0;
    std::atomic<bool> has_returned = false;
    run_with_threads(2, [&] {
        const TbbExecutor executor(kNoStop);
        const auto work = [&](std::int64_t role) {
            if (role == 0) {
                ASSERT_TRUE(await([&] { return calls > 0; })) << "two threads are needed";
                throw std::runtime_error("outer");
            }
            executor.for_each(kCount, [&](std::int64_t) {
                ++calls;
                std::this_thread::sleep_for(std::chrono::microseconds(100));
            });
            has_returned = true;
        };
        EXPECT_THROW(executor.for_each(2, work), std::runtime_error);
    });
    if (has_returned) {
        EXPECT_EQ(calls, kCount);
    }
}

/// Threads that take part in a loop, which goes on until `wanted` of them have or ten seconds have passed.
std::size_t threads_seen(int threads, std::size_t wanted) {
    std::mutex mutex;
    std::set<std::thread::id> ids;
    run_with_threads(threads, [&] {
        TbbExecutor(kNoStop).for_each(200, [&](std::int64_t i) {
            std::this_thread::sleep_for(std::chrono::microseconds(500));
            {
                const std::lock_guard lock(mutex);
                ids.insert(std::this_thread::get_id());
            }
            if (i == 0)
                await([&] {
                    const std::lock_guard lock(mutex);
                    return ids.size() >= wanted;
                });
        });
    });
    return ids.size();
}

TEST(RunWithThreads, OneMeansOne) { EXPECT_EQ(threads_seen(1, 1), 1U); }

TEST(RunWithThreads, MoreThanOneButNoMoreThanAsked) {
    const std::size_t seen = threads_seen(3, 2);
    EXPECT_GE(seen, 2U);
    EXPECT_LE(seen, 3U);
}

TEST(RunWithThreads, ThereIsAThreadByDefault) { EXPECT_GE(default_thread_count(), 1); }

}  // namespace
}  // namespace batchenc
