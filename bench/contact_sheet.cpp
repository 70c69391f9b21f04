#include "bench/contact_sheet.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "core/image/bitmap_font.h"
#include "core/image/canvas.h"
#include "core/image/heat_map.h"
#include "core/image/metrics.h"
#include "core/image/srgb.h"

namespace relume::bench {
namespace {

constexpr RgbColor kPaper{255, 255, 255}, kInk{24, 24, 24},
    kFrames[2] = {{255, 64, 64}, {64, 160, 255}};
constexpr int kColumns = 4, kEnlarged = 2, kCropEnlarged = 4;
constexpr int kGap = 8, kText = 2;  // pixels; enlargement of the font
constexpr double kLeast = 1e-4;     // error that is darkest; 1 is brightest
// The reference is shown so that this share of its pixels is darker than kShown.
constexpr double kShare = 0.9, kShown = 0.7;

using Color = std::array<denoise::Plane, 3>;

double Luma(const Color& c, std::size_t i) {
    return 0.2126 * c[0][i] + 0.7152 * c[1][i] + 0.0722 * c[2][i];
}

denoise::Plane RelativeError(const Color& test, const Color& reference) {
    denoise::Plane error(test[0].size());
    for (std::size_t i = 0; i < error.size(); ++i) {
        double sum = 0;
        for (std::size_t c = 0; c < 3; ++c) {
            const double r = reference[c][i], d = test[c][i] - r;
            sum += d * d / (r * r + kMrSEEpsilon) / 3;
        }
        error[i] = static_cast<float>(sum);
    }
    return error;
}

// Differences of neighbours' brightness, logarithmic.
denoise::Plane Detail(const Color& image, int width, int height, double scale) {
    denoise::Plane detail(image[0].size());
    const auto at = [&](int x, int y) {
        return std::log(Luma(image, static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                                        static_cast<std::size_t>(x)) *
                            scale +
                        0.01);
    };
    for (int y = 0; y + 1 < height; ++y) {
        for (int x = 0; x + 1 < width; ++x) {
            detail[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                   static_cast<std::size_t>(x)] =
                static_cast<float>(std::min(
                    1.0, std::abs(at(x + 1, y) - at(x, y)) + std::abs(at(x, y + 1) - at(x, y))));
        }
    }
    return detail;
}

struct Window {
    int x = 0, y = 0, width = 0, height = 0;
    bool Overlaps(const Window& w) const {
        return x < w.x + w.width && w.x < x + width && y < w.y + w.height && w.y < y + height;
    }
};

// Where the sum of the plane is largest, beside `taken`.
Window Brightest(const denoise::Plane& plane, int width, int height, Window size,
                 const Window& taken) {
    // Sums of all above and to the left.
    const auto columns = static_cast<std::size_t>(width) + 1;
    std::vector<double> sums(columns * (static_cast<std::size_t>(height) + 1), 0.0);
    for (std::size_t y = 0; y < static_cast<std::size_t>(height); ++y) {
        double row = 0;
        for (std::size_t x = 0; x < static_cast<std::size_t>(width); ++x) {
            row += plane[y * static_cast<std::size_t>(width) + x];
            sums[(y + 1) * columns + x + 1] = sums[y * columns + x + 1] + row;
        }
    }
    const auto sum = [&](int x, int y) {
        return sums[static_cast<std::size_t>(y) * columns + static_cast<std::size_t>(x)];
    };
    Window best = size;
    double most = -1;
    for (size.y = 0; size.y + size.height <= height; ++size.y) {
        for (size.x = 0; size.x + size.width <= width; ++size.x) {
            const int x1 = size.x + size.width, y1 = size.y + size.height;
            const double here =
                sum(x1, y1) - sum(size.x, y1) - sum(x1, size.y) + sum(size.x, size.y);
            if (here > most && !size.Overlaps(taken)) {
                most = here;
                best = size;
            }
        }
    }
    return best;
}

// Draws pixels of a window, `color` of each, enlarged.
void Draw(Canvas* canvas, int x0, int y0, const Window& window, int enlarged,
          const std::function<RgbColor(int x, int y)>& color) {
    for (int y = 0; y < window.height; ++y) {
        for (int x = 0; x < window.width; ++x) {
            canvas->Fill(x0 + x * enlarged, y0 + y * enlarged, enlarged, enlarged,
                         color(window.x + x, window.y + y));
        }
    }
}

void Frame(Canvas* canvas, int x, int y, int width, int height, const RgbColor& color) {
    canvas->Fill(x, y, width, 1, color);
    canvas->Fill(x, y + height - 1, width, 1, color);
    canvas->Fill(x, y, 1, height, color);
    canvas->Fill(x + width - 1, y, 1, height, color);
}

// The scale at which the reference looks well.
double Exposure(const Color& reference) {
    std::vector<double> lumas(reference[0].size());
    for (std::size_t i = 0; i < lumas.size(); ++i) {
        lumas[i] = Luma(reference, i);
    }
    const auto at =
        lumas.begin() + static_cast<std::ptrdiff_t>(kShare * static_cast<double>(lumas.size()));
    std::nth_element(lumas.begin(), at, lumas.end());
    return *at > 0 ? kShown / *at : 1;
}

}  // namespace

RgbPixels DrawContactSheet(const std::string& title, int width, int height,
                           const std::vector<SheetImage>& images, const SheetImage& reference) {
    const double scale = Exposure(reference.color);
    std::vector<denoise::Plane> errors;
    denoise::Plane all(reference.color[0].size(), 0.0f);
    for (const SheetImage& image : images) {
        errors.push_back(RelativeError(image.color, reference.color));
        for (std::size_t i = 0; i < all.size(); ++i) {
            all[i] += std::min(errors.back()[i], 1.0f);
        }
    }
    errors.emplace_back(all.size(), 0.0f);
    const Window crop{0, 0, std::max(1, width / (2 * kCropEnlarged)),
                      std::max(1, height / kCropEnlarged)};
    Window crops[2];
    crops[0] = Brightest(all, width, height, crop, {});
    crops[1] =
        Brightest(Detail(reference.color, width, height, scale), width, height, crop, crops[0]);

    const int line = (kGlyphHeight + 3) * kText;
    const int cell_width = kEnlarged * width + 2 * kGap,
              cell_height = 2 * line + (kEnlarged + 1) * height + 2 * kGap;
    const int count = static_cast<int>(images.size()) + 1, rows = (count + kColumns - 1) / kColumns;
    Canvas canvas(std::min(count, kColumns) * cell_width + kGap,
                  rows * cell_height + line + 2 * kGap, kPaper);
    canvas.Text(kGap, kGap, kText, title, kInk);
    for (int k = 0; k < count; ++k) {
        const bool last = k + 1 == count;
        const SheetImage& image = last ? reference : images[static_cast<std::size_t>(k)];
        const denoise::Plane& error = errors[static_cast<std::size_t>(k)];
        const int x0 = k % kColumns * cell_width + kGap,
                  y0 = k / kColumns * cell_height + line + 2 * kGap;
        const auto index = [&](int x, int y) {
            return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                   static_cast<std::size_t>(x);
        };
        const auto picture = [&](int x, int y) {
            RgbColor color{};
            for (std::size_t c = 0; c < 3; ++c) {
                color[c] = static_cast<std::uint8_t>(
                    std::lround(255 * EncodeSrgb(image.color[c][index(x, y)] * scale)));
            }
            return color;
        };
        canvas.Text(x0, y0, kText, image.label, kInk);
        canvas.Text(x0, y0 + line, kText, image.score, kInk);
        const Window whole{0, 0, width, height};
        const int top = y0 + 2 * line, below = top + kEnlarged * height + kGap / 2;
        Draw(&canvas, x0, top, whole, kEnlarged, picture);
        if (!last) {
            Draw(&canvas, x0, below, whole, 1, [&](int x, int y) {
                return HeatColor(
                    1 - std::log(std::max(static_cast<double>(error[index(x, y)]), kLeast)) /
                            std::log(kLeast));
            });
        }
        for (int c = 0; c < 2; ++c) {
            const Window& window = crops[c];
            const int x = x0 + width + c * kCropEnlarged * crop.width;
            Draw(&canvas, x, below, window, kCropEnlarged, picture);
            Frame(&canvas, x, below, kCropEnlarged * crop.width, kCropEnlarged * crop.height,
                  kFrames[c]);
            if (last) {
                Frame(&canvas, x0 + kEnlarged * window.x, top + kEnlarged * window.y,
                      kEnlarged * window.width, kEnlarged * window.height, kFrames[c]);
            }
        }
    }
    return canvas.Take();
}

}  // namespace relume::bench
