#pragma once

#include "core/film/tile.h"
#include "server/denoise/frame.h"

namespace relume::denoise {

// A part of a frame as a frame of its own; `rect` lies in the frame, (0, 0) its first pixel.
Frame CropFrame(const Frame& frame, const TileRect& rect);

Plane CropPlane(const Plane& plane, int width, const TileRect& rect);

// The other way: puts a part into its place in a plane that is `width` wide.
void PastePlane(const Plane& part, const TileRect& rect, int width, Plane* whole);

}  // namespace relume::denoise
