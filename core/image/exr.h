#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "core/image/image.h"

namespace relume {

// OpenEXR scanline files, the only door to the library. Channels are written as 32-bit floats with
// ZIP compression; data window, display window and text metadata are kept. Reading takes half,
// float and uint channels, scanlines or tiles, of the first part.

// Throws Error naming `name` and what is wrong with it (not an EXR, truncated, unsupported).
Image ReadExr(const std::filesystem::path& path);
Image ParseExr(std::string_view bytes, const std::string& name);

// The bytes of a file; WriteExr puts them down atomically (core/base/files.h).
std::string EncodeExr(const Image& image);
void WriteExr(const std::filesystem::path& path, const Image& image);

}  // namespace relume
