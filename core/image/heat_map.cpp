#include "core/image/heat_map.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/image/bitmap_font.h"
#include "core/image/heat_axis.h"

namespace relume {
namespace {

constexpr RgbColor kPaper{255, 255, 255}, kInk{24, 24, 24};
constexpr int kLeastSide = 512;  // of the picture, after enlarging
constexpr int kColors = 10;
constexpr RgbColor kViridis[kColors] = {
    {68, 1, 84},    {72, 40, 120},  {62, 73, 137},  {49, 104, 142}, {38, 130, 142},
    {31, 158, 137}, {53, 183, 121}, {110, 206, 88}, {181, 222, 43}, {253, 231, 37}};

// A coloured square with words.
struct Key {
    RgbColor color;
    std::string words;
};

std::string Share(std::size_t count, std::size_t all) {
    const double percent = 100 * static_cast<double>(count) / static_cast<double>(all);
    return percent > 0 && percent < 0.1 ? "<0.1 %" : fmt::format("{:.1f} %", percent);
}

// The colours of a plane's pixels and what they mean.
struct Painted {
    std::vector<RgbColor> colors;
    std::vector<Key> keys;
};

Painted PaintKinds(std::span<const float> plane, const std::vector<std::string>& kinds) {
    Painted painted;
    std::vector<std::size_t> counts(kinds.size() + 1);
    const auto color = [&](std::size_t kind) {
        return kind == kinds.size()
                   ? kHeatNotFinite
                   : HeatColor(static_cast<double>(kind) /
                               static_cast<double>(std::max<std::size_t>(kinds.size() - 1, 1)));
    };
    painted.colors.reserve(plane.size());
    for (const float value : plane) {
        const bool known =
            value >= 0 && value < static_cast<float>(kinds.size()) && value == std::floor(value);
        const std::size_t kind = known ? static_cast<std::size_t>(value) : kinds.size();
        ++counts[kind];
        painted.colors.push_back(color(kind));
    }
    for (std::size_t kind = 0; kind < kinds.size(); ++kind) {
        painted.keys.push_back(
            {color(kind), kinds[kind] + " " + Share(counts[kind], plane.size())});
    }
    if (counts.back() > 0) {
        painted.keys.push_back({kHeatNotFinite, "other " + Share(counts.back(), plane.size())});
    }
    return painted;
}

Painted PaintValues(std::span<const float> plane, const HeatAxis& axis) {
    Painted painted;
    std::size_t zeros = 0, bad = 0;
    painted.colors.reserve(plane.size());
    for (const float value : plane) {
        if (!std::isfinite(value)) {
            ++bad;
            painted.colors.push_back(kHeatNotFinite);
        } else if (value <= 0) {
            ++zeros;
            painted.colors.push_back(kHeatZero);
        } else {
            painted.colors.push_back(HeatColor(axis.Position(value)));
        }
    }
    if (zeros > 0) {
        painted.keys.push_back({kHeatZero, "0 or less " + Share(zeros, plane.size())});
    }
    if (bad > 0) {
        painted.keys.push_back({kHeatNotFinite, "not finite " + Share(bad, plane.size())});
    }
    return painted;
}

// Labels at a height of the canvas; one that would touch another is left out.
class Labels {
  public:
    Labels(Canvas* canvas, int y, int scale) : canvas_(canvas), y_(y), scale_(scale) {}

    static int Gap(int scale) { return (kGlyphWidth + 1) * scale; }

    // Its left end at x.
    void Place(int x, const std::string& text) {
        const int gap = Gap(scale_), end = x + TextWidth(text, scale_);
        for (const auto& [begin, other_end] : taken_) {
            if (x < other_end + gap && end + gap > begin) {
                return;
            }
        }
        taken_.emplace_back(x, end);
        canvas_->Text(x, y_, scale_, text, kInk);
    }

  private:
    Canvas* canvas_;
    int y_, scale_;
    std::vector<std::pair<int, int>> taken_;
};

// The bar of colours, [x, x+width) x [y, ...), with ticks and numbers below.
void DrawAxis(const HeatAxis& axis, int base, int x, int y, int width, int scale, Canvas* canvas) {
    const int bar = 10 * scale, tick = 3 * scale;
    for (int i = 0; i < width; ++i) {
        canvas->Fill(
            x + i, y, 1, bar,
            HeatColor(axis.low == axis.high ? 0.5 : (i + 0.5) / static_cast<double>(width)));
    }
    Labels labels(canvas, y + bar + tick + scale, scale);
    if (axis.low == axis.high) {
        const std::string text = "all " + HeatLabel(axis.low);
        labels.Place(x + (width - TextWidth(text, scale)) / 2, text);
        return;
    }
    const auto mark = [&](int at) { canvas->Fill(at, y + bar, scale, tick, kInk); };
    mark(x);
    mark(x + width - scale);
    const std::string low = (axis.beyond_low ? "<=" : "") + HeatLabel(axis.low);
    const std::string high = (axis.beyond_high ? ">=" : "") + HeatLabel(axis.high);
    labels.Place(x, low);
    labels.Place(x + width - TextWidth(high, scale), high);
    // The powers of the base, or every second one, ..., so that each has room for its number.
    int step = 1;
    const auto crowded = [&] {
        int room = 0;
        for (const double value : HeatTicks(axis, base, step)) {
            room += TextWidth(HeatLabel(value), scale) + Labels::Gap(scale);
        }
        return room > width;
    };
    while (crowded()) {
        ++step;
    }
    for (const double value : HeatTicks(axis, base, step)) {
        const int at = x + static_cast<int>(std::lround(axis.Position(value) * (width - scale)));
        mark(at);
        const std::string text = HeatLabel(value);
        labels.Place(at + (scale - TextWidth(text, scale)) / 2, text);
    }
}

}  // namespace

RgbColor HeatColor(double t) {
    const double place = std::clamp(t, 0.0, 1.0) * (kColors - 1);
    const int i = std::min(static_cast<int>(place), kColors - 2);
    RgbColor color;
    for (std::size_t c = 0; c < 3; ++c) {
        const double from = kViridis[i][c], to = kViridis[i + 1][c];
        color[c] = static_cast<std::uint8_t>(std::lround(std::lerp(from, to, place - i)));
    }
    return color;
}

RgbPixels DrawHeatMap(std::span<const float> plane, int width, int height,
                      const HeatMapStyle& style) {
    if (width <= 0 || height <= 0 ||
        plane.size() != static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) {
        ThrowInvalidArgument(
            fmt::format("a heat map of {}x{} pixels needs one value for each", width, height));
    }
    const bool has_axis = style.kinds.empty();
    const HeatAxis axis = has_axis ? FitHeatAxis(plane, style.clipped) : HeatAxis{};
    const Painted painted = has_axis ? PaintValues(plane, axis) : PaintKinds(plane, style.kinds);

    // Sizes. Letters grow with the picture, and the canvas is as wide as its words need.
    const int zoom = std::max(1, kLeastSide / std::max(width, height));
    const int scale = std::max(2, width / kLeastSide);
    const int margin = 4 * scale, line = (kGlyphHeight + 2) * scale,
              square = (kGlyphHeight - 1) * scale;
    const auto key_width = [&](const Key& key) {
        return square + 3 * scale + TextWidth(key.words, scale) + 8 * scale;
    };
    int keys_width = 0;
    for (const auto& key : painted.keys) {
        keys_width += key_width(key);
    }
    const int inside =
        std::max({width * zoom, kLeastSide, TextWidth(style.title, scale), keys_width});
    const int axis_height = has_axis && !axis.empty() ? 16 * scale + line : 0;
    const int keys_height = painted.keys.empty() ? 0 : line;
    const int picture_y = margin + line, below = picture_y + height * zoom + margin;
    Canvas canvas(inside + 2 * margin, below + axis_height + keys_height + margin, kPaper);

    canvas.Text(margin, margin, scale, style.title, kInk);
    const int picture_x = margin + (inside - width * zoom) / 2;
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            canvas.Fill(picture_x + x * zoom, picture_y + y * zoom, zoom, zoom,
                        painted.colors[static_cast<std::size_t>(y) * width + x]);
        }
    }
    if (axis_height > 0) {
        DrawAxis(axis, style.base, margin, below, inside, scale, &canvas);
    }
    int key_x = margin;
    for (const auto& key : painted.keys) {
        canvas.Fill(key_x, below + axis_height, square, square, key.color);
        canvas.Text(key_x + square + 3 * scale, below + axis_height, scale, key.words, kInk);
        key_x += key_width(key);
    }
    return canvas.Take();
}

}  // namespace relume
