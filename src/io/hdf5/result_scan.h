#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/error.h"
#include "io/hdf5/hdf5_handle.h"
#include "io/hdf5/result_digest.h"

namespace batchenc {

/// Walks over everything in a result and hashes it. Refused (kCorrupt) is whatever is not a group, a
/// contiguous one-dimensional dataset inside the file, or a scalar attribute, of one of the kinds of
/// ContentKind; links other than hard ones; and more content than the file has bytes, however it is linked.
/// Nothing is allocated beyond the file's size.
Expected<ResultDigest> scan_result(const hdf5::InputFile& input);

/// Opens a dataset of a result, checked as above, of that kind, and sets its extent.
Expected<hdf5::Handle> open_result_dataset(const hdf5::InputFile& input, const std::string& path,
                                           ContentKind kind, std::int64_t& extent);

/// The bytes of a scalar attribute as stored, checked to be of that kind. Error: kCorrupt (also: absent).
Expected<std::string> read_result_attribute(const hdf5::InputFile& input, hid_t object, const char* name,
                                            ContentKind kind);

}  // namespace batchenc
