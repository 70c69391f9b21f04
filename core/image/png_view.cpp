#include "core/image/png_view.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/image/encode_png.h"
#include "core/image/srgb.h"

namespace relume {
namespace {

// The planes to show: three colours, or one thrice.
std::array<std::span<const float>, 3> FindPlanes(const Image& image, const std::string& layer) {
    const std::string prefix = layer.empty() ? "" : layer + ".";
    for (const std::array<const char*, 3> names : {std::array{"R", "G", "B"}, {"X", "Y", "Z"}}) {
        if (image.Has(prefix + names[0]) && image.Has(prefix + names[1]) &&
            image.Has(prefix + names[2])) {
            return {image.Plane(prefix + names[0]), image.Plane(prefix + names[1]),
                    image.Plane(prefix + names[2])};
        }
    }
    std::vector<std::string> single;
    for (const auto& channel : image.channels()) {
        if (channel == layer || (!layer.empty() && channel.substr(0, prefix.size()) == prefix)) {
            single.push_back(channel);
        }
    }
    if (single.size() != 1) {
        ThrowInvalidArgument(fmt::format(
            "no layer '{}' of one or three channels can be shown; the image's channels are {}",
            layer, fmt::join(image.channels(), ", ")));
    }
    const auto plane = image.Plane(single.front());
    return {plane, plane, plane};
}

// 1 / the largest finite value; 0 if none is above 0.
float GreyScale(std::span<const float> plane) {
    float largest = 0;
    for (const float value : plane) {
        if (std::isfinite(value)) {
            largest = std::max(largest, value);
        }
    }
    return largest > 0 ? 1 / largest : 0;
}

}  // namespace

std::string EncodePngView(const Image& image, const std::string& layer, float exposure) {
    if (image.pixel_count() == 0) {
        ThrowInvalidArgument("a PNG needs at least one pixel");
    }
    const auto planes = FindPlanes(image, layer);
    const bool grey = planes[0].data() == planes[1].data();
    const float scale = std::exp2(exposure) * (grey ? GreyScale(planes[0]) : 1.0f);
    RgbPixels pixels{image.width(), image.height(), {}};
    std::vector<std::uint8_t>& rgb = pixels.bytes;
    rgb.resize(image.pixel_count() * 3);
    for (std::size_t i = 0; i < image.pixel_count(); ++i) {
        if (!std::isfinite(planes[0][i]) || !std::isfinite(planes[1][i]) ||
            !std::isfinite(planes[2][i])) {
            rgb[3 * i] = rgb[3 * i + 2] = 255;  // magenta
            continue;
        }
        for (std::size_t c = 0; c < 3; ++c) {
            const double encoded = EncodeSrgb(static_cast<double>(planes[c][i]) * scale);
            rgb[3 * i + c] = static_cast<std::uint8_t>(std::lround(255 * encoded));
        }
    }
    return EncodePng(pixels);
}

void WritePngView(const std::filesystem::path& path, const Image& image, const std::string& layer,
                  float exposure) {
    WriteFileAtomically(path, EncodePngView(image, layer, exposure));
}

}  // namespace relume
