#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "core/image/encode_png.h"

namespace relume {

using RgbColor = std::array<std::uint8_t, 3>;

// A picture to draw rectangles and labels on. What lies outside of it is not drawn.
class Canvas {
  public:
    Canvas(int width, int height, const RgbColor& background);

    int width() const { return pixels_.width; }
    int height() const { return pixels_.height; }

    // The pixels [x, x+width) x [y, y+height).
    void Fill(int x, int y, int width, int height, const RgbColor& color);
    // One line of ASCII, its top-left corner at (x, y), each dot of the font `scale` pixels wide.
    void Text(int x, int y, int scale, std::string_view text, const RgbColor& color);

    RgbPixels Take() { return std::move(pixels_); }

  private:
    RgbPixels pixels_;
};

// Pixels from the first dot to the last one.
int TextWidth(std::string_view text, int scale);

}  // namespace relume
