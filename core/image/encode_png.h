#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace relume {

// 8-bit pixels, three bytes each, row-major from the top-left one.
struct RgbPixels {
    int width = 0, height = 0;
    std::vector<std::uint8_t> bytes;
};

// The bytes of a PNG file: sRGB, 8 bits a channel. Throws kInvalidArgument if there is no pixel.
std::string EncodePng(const RgbPixels& pixels);

}  // namespace relume
