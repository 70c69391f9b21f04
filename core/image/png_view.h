#pragma once

#include <filesystem>
#include <string>

#include "core/image/image.h"

namespace relume {

// An 8-bit sRGB view of three channels, clamped to [0,1] after multiplying by 2^exposure. Of a
// crop, the data window alone. `layer` "" means R G B, "noisy" means noisy.R noisy.G noisy.B; a
// layer with one channel (Z, samples.Y) is shown grey, scaled to its largest finite value.
// Non-finite pixels are magenta.
std::string EncodePngView(const Image& image, const std::string& layer = "", float exposure = 0);
void WritePngView(const std::filesystem::path& path, const Image& image,
                  const std::string& layer = "", float exposure = 0);

}  // namespace relume
