#pragma once

#include <hdf5.h>

#include <optional>
#include <string>

namespace batchenc::hdf5 {

// Attributes of files that others wrote. They are a courtesy: what is absent, damaged or of an unexpected
// type or shape reads as nothing.

/// A numeric attribute with one element (any integer or floating-point type), if it is there and finite.
std::optional<double> read_optional_number(hid_t object, const char* name);

/// A string attribute with one element, of fixed or variable length, up to 4096 bytes, if it is there.
std::optional<std::string> read_optional_text(hid_t object, const char* name);

}  // namespace batchenc::hdf5
