#include "core/image/heat_map.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>

#include "core/base/error.h"
#include "core/image/bitmap_font.h"
#include "core/image/heat_axis.h"

namespace relume {
namespace {

using testing::ElementsAre;

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr RgbColor kPaper{255, 255, 255};

RgbColor At(const RgbPixels& map, int x, int y) {
    const std::size_t i = 3 * (static_cast<std::size_t>(y) * map.width + x);
    return {map.bytes[i], map.bytes[i + 1], map.bytes[i + 2]};
}

std::set<RgbColor> Colors(const RgbPixels& map) {
    std::set<RgbColor> colors;
    for (int y = 0; y < map.height; ++y) {
        for (int x = 0; x < map.width; ++x) {
            colors.insert(At(map, x, y));
        }
    }
    return colors;
}

// Relative luminance of sRGB.
double Luminance(const RgbColor& color) {
    double sum = 0;
    const double weights[] = {0.2126, 0.7152, 0.0722};
    for (std::size_t c = 0; c < 3; ++c) {
        const double v = color[c] / 255.0;
        sum += weights[c] * (v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4));
    }
    return sum;
}

// Where the picture begins in maps whose letters are two pixels a dot (up to 1023 pixels wide).
constexpr int kPictureX = 8, kPictureY = 28;

TEST(HeatColor, RisesInLightnessByEqualSteps) {
    EXPECT_EQ(HeatColor(0), (RgbColor{68, 1, 84}));
    EXPECT_EQ(HeatColor(1), (RgbColor{253, 231, 37}));
    EXPECT_EQ(HeatColor(-3), HeatColor(0));
    EXPECT_EQ(HeatColor(7), HeatColor(1));
    for (int i = 0; i < 64; ++i) {
        const auto lightness = [](int k) { return std::cbrt(Luminance(HeatColor(k / 64.0))); };
        EXPECT_GT(lightness(i + 1), lightness(i)) << i;
        // Viridis goes from lightness 15 to 91 of 100; a step of the table may differ by half.
        EXPECT_NEAR(116 * (lightness(i + 1) - lightness(i)), 76 / 64.0, 0.6) << i;
    }
}

TEST(HeatAxis, GoesFromTheLeastToTheLargestAboveZero) {
    const float plane[] = {0, 4, kNaN, -2, 64, kInfinity, 8};
    const HeatAxis axis = FitHeatAxis(plane, 0);
    EXPECT_EQ(axis.low, 4);
    EXPECT_EQ(axis.high, 64);
    EXPECT_FALSE(axis.beyond_low || axis.beyond_high);
    EXPECT_EQ(axis.Position(4), 0);
    EXPECT_NEAR(axis.Position(16), 0.5, 1e-12);
    EXPECT_EQ(axis.Position(64), 1);
    EXPECT_EQ(axis.Position(1), 0);
    EXPECT_THAT(HeatTicks(axis, 2, 1), ElementsAre(8, 16, 32));
    EXPECT_THAT(HeatTicks(axis, 2, 2), ElementsAre(16));
    EXPECT_THAT(HeatTicks(axis, 10, 1), ElementsAre(10));
    const float none[] = {0, kNaN, -1, kInfinity};
    EXPECT_TRUE(FitHeatAxis(none, 0.01).empty());
    EXPECT_THAT(HeatTicks(FitHeatAxis(none, 0.01), 10, 1), testing::IsEmpty());
}

TEST(HeatAxis, LeavesOutTheOutermost) {
    std::vector<float> plane(1000);
    for (std::size_t i = 0; i < plane.size(); ++i) {
        plane[i] = static_cast<float>(i * 7 % 1000 + 1);
    }
    const HeatAxis axis = FitHeatAxis(plane, 0.01);
    EXPECT_EQ(axis.low, 11);
    EXPECT_EQ(axis.high, 990);
    EXPECT_TRUE(axis.beyond_low && axis.beyond_high);
}

TEST(HeatLabel, IsShort) {
    for (const auto& [value, text] :
         std::vector<std::pair<double, std::string>>{{1, "1"},
                                                     {1048576, "1048576"},
                                                     {0.05, "0.05"},
                                                     {0.0187, "0.0187"},
                                                     {0.0001, "1e-4"},
                                                     {1.23e-12, "1.2e-12"},
                                                     {3e7, "3e7"},
                                                     {152.25, "152"}}) {
        EXPECT_EQ(HeatLabel(value), text);
    }
}

TEST(HeatMap, PaintsEachPixelByItsPlaceOnTheAxis) {
    const float plane[] = {1, 10, 100, 0, kNaN, 1000};
    const RgbPixels map = DrawHeatMap(plane, 3, 2, {"t", 10, 0, {}});
    // 512 / 3 = 170 pixels for one.
    const int zoom = 170, x0 = kPictureX + (512 - 3 * zoom) / 2;
    const RgbColor expected[] = {HeatColor(0), HeatColor(1 / 3.0), HeatColor(2 / 3.0),
                                 kHeatZero,    kHeatNotFinite,     HeatColor(1)};
    for (int i = 0; i < 6; ++i) {
        const int x = x0 + i % 3 * zoom, y = kPictureY + i / 3 * zoom;
        EXPECT_EQ(At(map, x, y), expected[i]) << i;
        EXPECT_EQ(At(map, x + zoom - 1, y + zoom - 1), expected[i]) << i;
    }
    // The bar, below the picture and a margin, as wide as the canvas without its margins.
    const int bar_y = kPictureY + 2 * zoom + 8;
    EXPECT_EQ(At(map, 8, bar_y), HeatColor(0.5 / 512));
    EXPECT_EQ(At(map, 8 + 511, bar_y + 19), HeatColor(511.5 / 512));
    for (int x = 0; x < map.width; ++x) {
        EXPECT_EQ(At(map, x, bar_y - 1), kPaper) << "bar and picture touch at " << x;
    }
    EXPECT_EQ(At(map, 7, bar_y), kPaper);
    EXPECT_EQ(At(map, 8 + 512, bar_y), kPaper);
}

TEST(HeatMap, TellsOfPixelsWithoutAPlaceOnlyIfThereAreAny) {
    const float good[] = {1, 2}, bad[] = {1, kNaN}, zero[] = {1, 0};
    const HeatMapStyle style{"t", 2, 0, {}};
    const RgbPixels plain = DrawHeatMap(good, 2, 1, style);
    EXPECT_EQ(Colors(plain).count(kHeatZero) + Colors(plain).count(kHeatNotFinite), 0u);
    for (const auto& plane : {bad, zero}) {
        const RgbPixels map = DrawHeatMap({plane, 2}, 2, 1, style);
        EXPECT_GT(map.height, plain.height);
        // The key's square is in the last line.
        EXPECT_EQ(At(map, 8, map.height - 8 - 8), plane == bad ? kHeatNotFinite : kHeatZero);
    }
}

TEST(HeatMap, OfOnePixelOrAConstantPlaneHasTheMiddleColour) {
    const std::vector<float> plane(12, 16.0f);
    for (const auto& [width, height] : {std::pair{1, 1}, {4, 3}, {12, 1}, {1, 12}}) {
        const RgbPixels map = DrawHeatMap({plane.data(), static_cast<std::size_t>(width * height)},
                                          width, height, {"t", 2, 0, {}});
        EXPECT_EQ(At(map, map.width / 2, kPictureY), HeatColor(0.5));
        EXPECT_THAT(Colors(map),
                    testing::UnorderedElementsAre(HeatColor(0.5), kPaper, RgbColor({24, 24, 24})));
    }
}

TEST(HeatMap, OfNothingAboveZeroHasNoBar) {
    const float plane[] = {0, -1, 0, kNaN};
    const RgbPixels map = DrawHeatMap(plane, 2, 2, {"t", 10, 0.1, {}});
    EXPECT_THAT(Colors(map), testing::UnorderedElementsAre(kHeatZero, kHeatNotFinite, kPaper,
                                                           RgbColor({24, 24, 24})));
}

TEST(HeatMap, KeepsThePixelsOfALargePictureAndItsLettersGrow) {
    std::vector<float> plane(2100 * 3, 1.0f);
    plane[2099] = 8;
    const RgbPixels map = DrawHeatMap(plane, 2100, 3, {"t", 2, 0, {}});
    const int scale = 2100 / 512, margin = 4 * scale;
    EXPECT_EQ(map.width, 2100 + 2 * margin);
    const int y = margin + 10 * scale;
    EXPECT_EQ(At(map, margin + 2099, y), HeatColor(1));
    EXPECT_EQ(At(map, margin + 2098, y), HeatColor(0));
    EXPECT_EQ(At(map, margin, y + 2), HeatColor(0));
    EXPECT_EQ(At(map, margin, y + 3), kPaper);
}

TEST(HeatMap, IsAsWideAsItsWords) {
    const float plane[] = {1};
    const std::string title(100, 'x');
    const RgbPixels map = DrawHeatMap(plane, 1, 1, {title, 10, 0, {}});
    EXPECT_EQ(map.width, TextWidth(title, 2) + 16);
}

TEST(HeatMap, KindsHaveFlatColoursAndAKeyEach) {
    const float plane[] = {0, 1, 2, 2, 0.5f, kNaN};
    const RgbPixels map = DrawHeatMap(plane, 6, 1, {"t", 10, 0, {"a", "b", "c"}});
    const int zoom = 512 / 6, x0 = kPictureX + (map.width - 16 - 6 * zoom) / 2;
    const RgbColor expected[] = {HeatColor(0), HeatColor(0.5), HeatColor(1),
                                 HeatColor(1), kHeatNotFinite, kHeatNotFinite};
    for (int i = 0; i < 6; ++i) {
        EXPECT_EQ(At(map, x0 + i * zoom, kPictureY), expected[i]) << i;
    }
    EXPECT_THAT(Colors(map),
                testing::UnorderedElementsAre(HeatColor(0), HeatColor(0.5), HeatColor(1),
                                              kHeatNotFinite, kPaper, RgbColor({24, 24, 24})));
}

TEST(HeatMap, NeedsAValueForEachPixel) {
    const float plane[] = {1, 2, 3};
    EXPECT_THROW(DrawHeatMap(plane, 2, 2, {}), Error);
    EXPECT_THROW(DrawHeatMap({}, 0, 0, {}), Error);
}

TEST(Font, GlyphsDifferAndOthersAreQuestionMarks) {
    std::set<std::array<std::uint8_t, kGlyphWidth>> glyphs;
    for (char c = ' '; c <= '~'; ++c) {
        EXPECT_TRUE(glyphs.insert(GlyphColumns(c)).second) << c;
    }
    EXPECT_EQ(GlyphColumns('\n'), GlyphColumns('?'));
    EXPECT_EQ(GlyphColumns('\xe9'), GlyphColumns('?'));
}

TEST(Canvas, DrawsTextDotByDotAndNothingBeyondItsEdges) {
    Canvas canvas(12, 8, kPaper);
    canvas.Text(0, 0, 2, "!", {0, 0, 0});  // its third column: rows 0 to 4 and 6
    canvas.Fill(-5, 7, 100, 100, {1, 2, 3});
    const RgbPixels pixels = canvas.Take();
    EXPECT_EQ(At(pixels, 4, 0), (RgbColor{0, 0, 0}));
    EXPECT_EQ(At(pixels, 5, 6), (RgbColor{0, 0, 0}));
    EXPECT_EQ(At(pixels, 3, 0), kPaper);
    EXPECT_EQ(At(pixels, 6, 0), kPaper);
    EXPECT_EQ(At(pixels, 0, 7), (RgbColor{1, 2, 3}));
    EXPECT_EQ(At(pixels, 11, 7), (RgbColor{1, 2, 3}));
    EXPECT_EQ(TextWidth("ab", 3), 33);
    EXPECT_EQ(TextWidth("", 3), 0);
}

}  // namespace
}  // namespace relume
