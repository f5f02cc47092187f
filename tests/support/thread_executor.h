#pragma once

#include <atomic>
#include <thread>
#include <vector>

#include "core/executor.h"

namespace batchenc::test {

/// Runs work on threads of its own: what the thread sanitizer can follow, unlike Debian's build of oneTBB.
class ThreadExecutor final : public Executor {
 public:
    explicit ThreadExecutor(int threads) : threads_(threads) {}
    void for_each(std::int64_t count, const std::function<void(std::int64_t)>& function) const override {
        std::atomic<std::int64_t> next = 0;
        const auto work = [&] {
            for (std::int64_t i = next++; i < count; i = next++) function(i);
        };
        std::vector<std::thread> others;
        for (int t = 1; t < threads_; ++t) others.emplace_back(work);
        work();
        for (std::thread& thread : others) thread.join();
    }

 private:
    int threads_;
};

}  // namespace batchenc::test
