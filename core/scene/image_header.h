#pragma once

#include <string>
#include <string_view>

namespace relume {

struct ImageSize {
    int width = 0, height = 0;
    bool floats = false;  // not bytes, once decoded
};

// Size of a PNG, JPEG, Radiance HDR, OpenEXR, PFM or TGA picture from its header, without decoding.
// Throws naming `name` if the bytes are none of these or, where that is cheap to see (PNG, JPEG,
// PFM), cut short.
ImageSize ReadImageHeader(std::string_view bytes, const std::string& name);

}  // namespace relume
