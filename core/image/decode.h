#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace relume {

// A texture's pixels as its file has them; row 0 is the top. Exactly one of `bytes` and `floats` is
// filled.
struct DecodedImage {
    int width = 0;
    int height = 0;
    int channels = 0;                 // 1 to 4, interleaved
    std::vector<std::uint8_t> bytes;  // 8-bit files: PNG, JPEG, TGA; 16-bit PNG is cut to 8
    std::vector<float> floats;        // Radiance HDR, OpenEXR, PFM: linear
};

// Throws Error with `name` and the reason if the bytes are not a picture that can be read, or are
// larger than 2^28 pixels.
DecodedImage DecodeImage(std::string_view bytes, const std::string& name);

}  // namespace relume
