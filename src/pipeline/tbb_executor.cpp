#include "pipeline/tbb_executor.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#include <tbb/task_group.h>

namespace batchenc {

void TbbExecutor::for_each(std::int64_t count, const std::function<void(std::int64_t)>& function) const {
    using Range = tbb::blocked_range<std::int64_t>;
    const auto call_all = [&](const Range& range) {
        for (std::int64_t i = range.begin(); i < range.end(); ++i) {
            if (stop_->load(std::memory_order_relaxed)) throw Interrupted{};
            function(i);
        }
    };
    tbb::task_group_context context;  // belongs to that of the loop around this one
    tbb::this_task_arena::isolate([&] { tbb::parallel_for(Range(0, count), call_all, context); });
    // An exception in the loop around cancels this one, and oneTBB then returns with indices left out.
    if (context.is_group_execution_cancelled()) throw Interrupted{};
}

}  // namespace batchenc
