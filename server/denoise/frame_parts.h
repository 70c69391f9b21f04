#pragma once

#include <vector>

#include "core/film/tile.h"
#include "server/denoise/frame.h"

namespace relume::denoise {

// A window of a frame, with a halo around what is looked at.
struct FramePart {
    Frame frame;     // halo included
    TileRect inner;  // what counts, in pixels of `frame`
    TileRect outer;  // `frame` in the whole
};

// Windows of 64x64 pixels, one at a random place of each cell of a grid, the same each time: with
// their halos of 24 about one part in `share` of the frame, at least `fewest` windows. Of a frame
// of which they would be nearly all: one window, the whole.
std::vector<TileRect> ChooseWindows(const Frame& frame, int share, double fewest = 8);

FramePart CutPart(const Frame& frame, const TileRect& window);

}  // namespace relume::denoise
