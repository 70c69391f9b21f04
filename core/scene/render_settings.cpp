#include "core/scene/render_settings.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/base/error.h"

namespace relume {

namespace {

void ValidateLook(const LookCamera& look) {
    const Vec3f forward = look.at - look.from;
    if (!IsFinite(look.from) || !IsFinite(look.at) || !IsFinite(look.up) ||
        !std::isfinite(Length(forward))) {
        ThrowInvalidArgument("look from, look at and look up must be finite numbers");
    }
    if (!(Length(forward) > 0)) {
        ThrowInvalidArgument("look from and look at are the same point; move one of them");
    }
    // The sine of the angle between.
    const float across =
        Length(Cross(forward / Length(forward), look.up)) / std::max(Length(look.up), 1e-30f);
    if (!(across > 1e-5f)) {
        ThrowInvalidArgument(
            "look up is 0 or runs along the view; choose another --look-up, e.g. 0,0,1");
    }
    if (!(look.fov >= 1 && look.fov <= 175)) {
        ThrowInvalidArgument(fmt::format("field of view {}: must be 1 to 175 degrees", look.fov));
    }
}

}  // namespace

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
        !std::isfinite(s.environment_scale) || !std::isfinite(s.time) ||
        !std::isfinite(s.shutter)) {
        ThrowInvalidArgument(
            "lens radius, focus distance, environment scale, time and shutter must be finite "
            "numbers");
    }
    if (s.look) {
        ValidateLook(*s.look);
        if (!s.camera.empty()) {
            ThrowInvalidArgument(
                "a camera of the scene and one of the job's own (look from) "
                "exclude each other; leave one out");
        }
    }
    if (s.max_depth < 1 || s.max_depth > kMaxDepth) {
        ThrowInvalidArgument(fmt::format("max depth {}: must be 1 to {}", s.max_depth, kMaxDepth));
    }
}

}  // namespace relume
