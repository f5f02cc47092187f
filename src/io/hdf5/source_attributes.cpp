#include "io/hdf5/source_attributes.h"

#include <cmath>
#include <cstring>

#include "io/hdf5/hdf5_handle.h"

namespace batchenc::hdf5 {

namespace {

constexpr std::size_t kLongestText = 4096;

struct OneElement {
    Handle attribute;
    Handle type;
};

std::optional<OneElement> open_one_element(hid_t object, const char* name) {
    if (H5Aexists(object, name) <= 0) return {};
    OneElement element{Handle(H5Aopen(object, name, H5P_DEFAULT), H5Aclose), {}};
    if (!element.attribute) return {};
    element.type = Handle(H5Aget_type(element.attribute.get()), H5Tclose);
    const Handle space(H5Aget_space(element.attribute.get()), H5Sclose);
    if (!element.type || !space || H5Sget_simple_extent_npoints(space.get()) != 1) return {};
    return element;
}

}  // namespace

std::optional<double> read_optional_number(hid_t object, const char* name) {
    const auto element = open_one_element(object, name);
    if (!element) return {};
    const H5T_class_t kind = H5Tget_class(element->type.get());
    if (kind != H5T_FLOAT && kind != H5T_INTEGER) return {};
    double value = 0.0;
    if (H5Aread(element->attribute.get(), H5T_NATIVE_DOUBLE, &value) < 0 || !std::isfinite(value)) return {};
    return value;
}

std::optional<std::string> read_optional_text(hid_t object, const char* name) {
    const auto element = open_one_element(object, name);
    if (!element || H5Tget_class(element->type.get()) != H5T_STRING) return {};
    const htri_t variable = H5Tis_variable_str(element->type.get());
    if (variable < 0) return {};
    std::string text;
    if (variable > 0) {
        char* owned = nullptr;  // belongs to HDF5, which puts a terminator after it
        if (H5Aread(element->attribute.get(), element->type.get(), &owned) < 0 || owned == nullptr) return {};
        if (const std::size_t length = ::strnlen(owned, kLongestText + 1); length <= kLongestText)
            text.assign(owned, length);
        H5free_memory(owned);
    } else {
        const std::size_t size = H5Tget_size(element->type.get());
        if (size == 0 || size > kLongestText) return {};
        text.resize(size);
        if (H5Aread(element->attribute.get(), element->type.get(), text.data()) < 0) return {};
        text.resize(::strnlen(text.data(), size));
        if (H5Tget_strpad(element->type.get()) == H5T_STR_SPACEPAD)
            text.resize(text.find_last_not_of(' ') + 1);  // npos + 1 is 0
    }
    return text;
}

}  // namespace batchenc::hdf5
