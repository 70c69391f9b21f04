#include "core/image/encode_png.h"

#include <fmt/format.h>
#include <png.h>

#include "core/base/check.h"
#include "core/base/error.h"

namespace relume {

std::string EncodePng(const RgbPixels& pixels) {
    if (pixels.width <= 0 || pixels.height <= 0) {
        ThrowInvalidArgument("a PNG needs at least one pixel");
    }
    RELUME_CHECK_EQ(pixels.bytes.size(), std::size_t{3} * static_cast<std::size_t>(pixels.width) *
                                             static_cast<std::size_t>(pixels.height));
    png_image png{};
    png.version = PNG_IMAGE_VERSION;
    png.width = static_cast<png_uint_32>(pixels.width);
    png.height = static_cast<png_uint_32>(pixels.height);
    png.format = PNG_FORMAT_RGB;
    png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(png);
    std::string bytes(size, '\0');
    if (png_image_write_to_memory(&png, bytes.data(), &size, 0, pixels.bytes.data(), 0, nullptr) ==
        0) {
        throw Error(ErrorCode::kInternal, fmt::format("can't make a PNG: {}", png.message));
    }
    bytes.resize(size);
    return bytes;
}

}  // namespace relume
