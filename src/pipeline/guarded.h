#pragma once

#include <new>

#include "core/error.h"
#include "pipeline/tbb_executor.h"

namespace batchenc {

/// Calls function, which returns an Expected, and turns whatever it throws into an Error: an exception that
/// left a node of the graph would cancel every other job. Once `stop` is true every failure is kInterrupted,
/// because code on the way may have made an error of its own out of the executor's Interrupted.
template <typename Function>
auto guarded(const std::atomic<bool>& stop, Function&& function) -> decltype(function()) {
    const auto call = [&]() -> decltype(function()) {
        try {
            if (stop.load(std::memory_order_relaxed)) throw Interrupted{};
            return function();
        } catch (const Interrupted&) {
            return fail(ErrorCode::kInterrupted, "stopped on request");
        } catch (const std::bad_alloc&) {
            return fail(ErrorCode::kOutOfMemory, "an allocation failed; shorter clips need less memory");
        } catch (const std::exception& exception) {
            return fail(ErrorCode::kInternal, exception.what());
        } catch (...) {
            return fail(ErrorCode::kInternal, "an exception of unknown type");
        }
    };
    auto result = call();
    if (!result && stop.load(std::memory_order_relaxed))
        return fail(ErrorCode::kInterrupted, "stopped on request");
    return result;
}

}  // namespace batchenc
