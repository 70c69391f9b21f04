#pragma once

#include <cstdint>
#include <string>

#include "core/film/tile.h"
#include "core/math/vec.h"

namespace relume::client {

// Values of options as they stand on the command line. Each throws kInvalidArgument that names the
// option, what it got, and its form or range.

struct Size {
    int width = 0, height = 0;
};
// "1280x720"; sides and area within the limits of core/scene/render_settings.h.
Size ParseSize(const std::string& text);

// "X0,Y0,X1,Y1": pixels [X0,X1) x [Y0,Y1), y down; not empty. Whether it lies in the image is seen
// later, when the size is known.
TileRect ParseCrop(const std::string& text);

// "X,Y,Z", three finite numbers; `option` is named in errors.
Vec3f ParseVector(const std::string& option, const std::string& text);

// A number above 0 and at most `most`; `option` is named in errors.
double ParsePositive(const std::string& option, double most, const std::string& text);
// The same for whole numbers.
std::uint32_t ParseCount(const std::string& option, double most, const std::string& text);

}  // namespace relume::client
