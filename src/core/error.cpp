#include "core/error.h"

namespace batchenc {

const char* error_code_name(ErrorCode code) {
    switch (code) {
        case ErrorCode::kInvalidArgument:
            return "invalid-argument";
        case ErrorCode::kIo:
            return "io";
        case ErrorCode::kFormat:
            return "format";
        case ErrorCode::kCorrupt:
            return "corrupt";
        case ErrorCode::kUnsupported:
            return "unsupported";
        case ErrorCode::kLimit:
            return "limit";
        case ErrorCode::kNotFinite:
            return "not-finite";
        case ErrorCode::kOutOfRange:
            return "out-of-range";
        case ErrorCode::kExists:
            return "exists";
        case ErrorCode::kNumerical:
            return "numerical";
        case ErrorCode::kInterrupted:
            return "interrupted";
        case ErrorCode::kOutOfMemory:
            return "out-of-memory";
        case ErrorCode::kVerification:
            return "verification";
        case ErrorCode::kInternal:
            return "internal";
    }
    return "unknown";
}

std::string Error::to_string() const {
    std::string text = where.empty() ? message : where + ": " + message;
    return text + " [" + error_code_name(code) + "]";
}

tl::unexpected<Error> fail_within(const std::string& outer, Error error) {
    error.where = error.where.empty() ? outer : outer + ": " + error.where;
    return tl::unexpected<Error>(std::move(error));
}

}  // namespace batchenc
