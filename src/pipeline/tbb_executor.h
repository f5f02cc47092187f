#pragma once

#include <atomic>

#include "core/executor.h"

namespace batchenc {

/// Leaves TbbExecutor::for_each when a stop was requested, or when the for_each around it is being left by an
/// exception.
struct Interrupted {};

/// Runs independent work on oneTBB's threads. A thread that waits for the rest of its own for_each takes up
/// nothing but parts of that for_each, so a stage of the graph is never entered from inside another.
class TbbExecutor final : public Executor {
 public:
    /// stop: looked at before every index; once it is true, for_each throws Interrupted. Outlives the object.
    /// A for_each that returns has called every index.
    explicit TbbExecutor(const std::atomic<bool>& stop) : stop_(&stop) {}

    void for_each(std::int64_t count, const std::function<void(std::int64_t)>& function) const override;

 private:
    const std::atomic<bool>* stop_;
};

}  // namespace batchenc
