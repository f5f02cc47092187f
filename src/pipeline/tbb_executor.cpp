#include "pipeline/tbb_executor.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

namespace batchenc {

void TbbExecutor::for_each(std::int64_t count, const std::function<void(std::int64_t)>& function) const {
    using Range = tbb::blocked_range<std::int64_t>;
    tbb::this_task_arena::isolate([&] {
        tbb::parallel_for(Range(0, count), [&](const Range& range) {
            for (std::int64_t i = range.begin(); i < range.end(); ++i) {
                if (stop_->load(std::memory_order_relaxed)) throw Interrupted{};
                function(i);
            }
        });
    });
}

}  // namespace batchenc
