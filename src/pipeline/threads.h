#pragma once

#include <functional>

namespace batchenc {

/// Threads that this process may run on at once (its CPU affinity counted).
int default_thread_count();

/// Runs body with `threads` threads in all, the calling one included: 1 means that nothing runs beside it.
/// threads: 1 … 1024. Whatever TbbExecutor and run_clip_graph do inside body keeps to that number.
void run_with_threads(int threads, const std::function<void()>& body);

}  // namespace batchenc
