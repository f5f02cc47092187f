#pragma once

#include <cstdint>
#include <functional>

namespace batchenc {

/// The one door through which threads enter kernels and codecs.
///
/// A codec hands over independent work; what it hands over must give the same result for any order and any
/// number of threads, so each call writes only what its index owns.
class Executor {
 public:
    virtual ~Executor() = default;

    /// Calls function(i) once for every i in [0, count), in any order, perhaps at once; returns when all are
    /// done. An exception from function leaves through this call after the running ones have ended.
    virtual void for_each(std::int64_t count, const std::function<void(std::int64_t)>& function) const = 0;
};

/// Runs everything in the calling thread, in order.
class SerialExecutor final : public Executor {
 public:
    void for_each(std::int64_t count, const std::function<void(std::int64_t)>& function) const override;
};

/// Runs everything in the calling thread, in an order drawn from a seed: shows hidden dependencies in tests.
class ShuffledExecutor final : public Executor {
 public:
    explicit ShuffledExecutor(std::uint64_t seed) : seed_(seed) {}
    void for_each(std::int64_t count, const std::function<void(std::int64_t)>& function) const override;

 private:
    std::uint64_t seed_;
};

}  // namespace batchenc
