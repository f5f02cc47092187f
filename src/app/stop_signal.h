#pragma once

#include <atomic>

namespace batchenc {

/// From now on SIGINT and SIGTERM set the flag that is returned, and nothing else: the work that looks at it
/// ends cleanly. A second signal of the same kind ends the program at once.
const std::atomic<bool>& install_stop_signals();

}  // namespace batchenc
