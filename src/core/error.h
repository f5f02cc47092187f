#pragma once

#include <string>
#include <tl/expected.hpp>

namespace batchenc {

/// What went wrong, as a number that scripts may rely on: printed, logged, tested and never renumbered.
enum class ErrorCode : int {
    kInvalidArgument = 1,  ///< a parameter is outside its range, or two contradict each other
    kIo = 2,               ///< the operating system or HDF5 refused to read or write
    kFormat = 3,           ///< a file or stream is not of the expected kind or layout
    kCorrupt = 4,          ///< the layout is right but a checksum or a value inside is not
    kUnsupported = 5,      ///< well-formed, but of a version, filter or method that this build does not have
    kLimit = 6,            ///< larger than a stated limit; nothing was allocated
    kNotFinite = 7,        ///< NaN or Inf where a number is needed
    kOutOfRange = 8,       ///< an index points outside what it indexes
    kExists = 9,           ///< the output exists and neither overwrite nor resume was asked for
    kNumerical = 10,       ///< a LAPACK routine did not converge
    kInterrupted = 11,     ///< stopped on request; nothing half-written is left
    kOutOfMemory = 12,     ///< an allocation failed
    kVerification = 13,    ///< the decoded result is not what was promised
    kInternal = 14,        ///< a defect of this program
};

/// Stable lower-case name of a code, such as "corrupt"; "unknown" for a number that is none.
const char* error_code_name(ErrorCode code);

/// One failure: what, in words for the person who has to mend it, and where (file, place inside it).
struct Error {
    ErrorCode code = ErrorCode::kInternal;
    std::string message;  ///< cause, without the place
    std::string where;    ///< "jobs/a.yaml:3:5", "clip.h5:/positions", "clip 2, section basis"; may be empty

    /// "where: message [name]", on one line.
    std::string to_string() const;
};

/// A value or the one error that prevented it. Nothing throws across a folder's border.
template <typename T>
using Expected = tl::expected<T, Error>;

/// The failing half of an Expected.
inline tl::unexpected<Error> fail(ErrorCode code, std::string message, std::string where = {}) {
    return tl::unexpected<Error>(Error{code, std::move(message), std::move(where)});
}

/// Passes an error on with the outer place put before its own: "outer: inner".
tl::unexpected<Error> fail_within(const std::string& outer, Error error);

}  // namespace batchenc
