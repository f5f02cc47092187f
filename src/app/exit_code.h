#pragma once

#include "core/error.h"

namespace batchenc {

inline constexpr int kExitDone = 0;
inline constexpr int kExitFailed = 1;         ///< some job failed; the others are done
inline constexpr int kExitUsage = 2;          ///< bad command line or job file; nothing was run
inline constexpr int kExitInterrupted = 130;  ///< stopped on request

/// Exit code of a command that ended with this error.
inline int exit_code_of(const Error& error) {
    return error.code == ErrorCode::kInterrupted ? kExitInterrupted : kExitFailed;
}

}  // namespace batchenc
