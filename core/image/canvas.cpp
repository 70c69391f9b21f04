#include "core/image/canvas.h"

#include <algorithm>

#include "core/image/bitmap_font.h"

namespace relume {

Canvas::Canvas(int width, int height, const RgbColor& background) : pixels_{width, height, {}} {
    pixels_.bytes.resize(std::size_t{3} * static_cast<std::size_t>(width) *
                         static_cast<std::size_t>(height));
    Fill(0, 0, width, height, background);
}

void Canvas::Fill(int x, int y, int width, int height, const RgbColor& color) {
    const int x0 = std::max(x, 0), x1 = std::min(x + width, this->width());
    for (int row = std::max(y, 0); row < std::min(y + height, this->height()); ++row) {
        std::uint8_t* line = pixels_.bytes.data() + std::size_t{3} * static_cast<std::size_t>(row) *
                                                        static_cast<std::size_t>(this->width());
        for (int column = x0; column < x1; ++column) {
            std::copy(color.begin(), color.end(), line + std::ptrdiff_t{3} * column);
        }
    }
}

void Canvas::Text(int x, int y, int scale, std::string_view text, const RgbColor& color) {
    for (const char c : text) {
        for (const std::uint8_t column : GlyphColumns(c)) {
            for (int row = 0; row < kGlyphHeight; ++row) {
                if ((column >> row & 1) != 0) {
                    Fill(x, y + row * scale, scale, scale, color);
                }
            }
            x += scale;
        }
        x += scale;
    }
}

int TextWidth(std::string_view text, int scale) {
    return text.empty() ? 0 : scale * (static_cast<int>(text.size()) * (kGlyphWidth + 1) - 1);
}

}  // namespace relume
