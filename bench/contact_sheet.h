#pragma once

#include <array>
#include <string>
#include <vector>

#include "core/image/encode_png.h"
#include "server/denoise/frame.h"

namespace relume::bench {

// One image of a contact sheet.
struct SheetImage {
    std::string label, score;  // a line each, ASCII
    std::array<denoise::Plane, 3> color;
};

// Images of `width` x `height` pixels side by side, four in a row, all at the exposure that suits
// the reference. Each twice enlarged, below it where its error lies (relative squared error from
// 1e-4, dark, to 1, bright) and two crops enlarged four times: where the images err most, and where
// the reference has most detail. The reference comes last.
RgbPixels DrawContactSheet(const std::string& title, int width, int height,
                           const std::vector<SheetImage>& images, const SheetImage& reference);

}  // namespace relume::bench
