#include "core/scene/render_settings.h"

#include <fmt/format.h>

#include <cmath>

#include "core/base/error.h"

namespace relume {

void ValidateSettings(const RenderSettings& s) {
    if (s.width < 1 || s.height < 1 || s.width > kMaxImageSide || s.height > kMaxImageSide ||
        static_cast<std::int64_t>(s.width) * s.height > kMaxImagePixels) {
        ThrowInvalidArgument(
            fmt::format("size {}x{}: each side must be 1 to {} and the image at most {} "
                        "pixels; choose a smaller --size",
                        s.width, s.height, kMaxImageSide, kMaxImagePixels));
    }
    if (s.crop != TileRect{} &&
        (s.crop.empty() || !TileRect{0, 0, s.width, s.height}.Contains(s.crop))) {
        ThrowInvalidArgument(fmt::format("crop {},{},{},{} is empty or leaves the {}x{} image",
                                         s.crop.x0, s.crop.y0, s.crop.x1, s.crop.y1, s.width,
                                         s.height));
    }
    if (!std::isfinite(s.lens_radius) || !std::isfinite(s.focus_distance) ||
        !std::isfinite(s.environment_scale)) {
        ThrowInvalidArgument(
            "lens radius, focus distance and environment scale must be finite numbers");
    }
    if (s.max_depth < 1 || s.max_depth > 1024) {
        ThrowInvalidArgument(fmt::format("max depth {}: must be 1 to 1024", s.max_depth));
    }
}

}  // namespace relume
