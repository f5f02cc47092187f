#include "pipeline/threads.h"

#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/task_arena.h>

namespace batchenc {

int default_thread_count() { return tbb::info::default_concurrency(); }

void run_with_threads(int threads, const std::function<void()>& body) {
    // The arena bounds what runs here; the global control bounds the workers of the process, and allows more
    // of them than there are processors when that is asked for.
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                    static_cast<std::size_t>(threads));
    tbb::task_arena arena(threads);
    arena.execute(body);
}

}  // namespace batchenc
