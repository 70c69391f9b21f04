#pragma once

#include <array>
#include <cstdint>

namespace relume {

// A fixed-width font for labels in pictures: printable ASCII, 5 x 8 dots a glyph, of which the
// lowest row is for descenders; to be set with an empty column and row between.
inline constexpr int kGlyphWidth = 5, kGlyphHeight = 8;

// The columns of a glyph from left to right; bit 0 is the top row. Others than printable ASCII
// look like '?'.
const std::array<std::uint8_t, kGlyphWidth>& GlyphColumns(char c);

}  // namespace relume
