#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/image/canvas.h"
#include "core/image/encode_png.h"

namespace relume {

// How a plane of numbers is shown.
struct HeatMapStyle {
    std::string title;  // ASCII: the layer, what it measures, the unit
    // The ticks of the logarithmic axis are powers of this: 2, or 10.
    int base = 10;
    // Share of the values above 0 that may lie beyond either end of the axis, and have the colour
    // of that end: 0 to below 0.5. So a few odd pixels do not take the contrast from the others.
    double clipped = 0;
    // If there are any, the plane holds indices of these kinds, and there is no axis.
    std::vector<std::string> kinds;
};

// The colour of t in [0,1], beyond it that of the nearer end: from dark blue over green to yellow,
// equal steps look equal, and it rises in brightness, so that it reads in grey (viridis of S. van
// der Walt and N. Smith, CC0: linear in sRGB between ten of its colours).
RgbColor HeatColor(double t);
// Of pixels that have no place on the axis.
inline constexpr RgbColor kHeatZero{176, 176, 176};     // 0 or less, no logarithm
inline constexpr RgbColor kHeatNotFinite{255, 0, 255};  // NaN, infinite; of kinds, none of them

// A plane, row-major, as a picture with its title above and the axis or the kinds below, with the
// share of the pixels that each kind and those without a place have. A picture that is smaller than
// 512 pixels is enlarged by a whole number. Throws kInvalidArgument if there is no pixel, or if the
// plane's size is not width x height.
RgbPixels DrawHeatMap(std::span<const float> plane, int width, int height,
                      const HeatMapStyle& style);

}  // namespace relume
