#include "core/film/film.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "core/base/error.h"
#include "core/image/metrics.h"

namespace relume {
namespace {

// All channels of a few pixels, one after the other.
constexpr std::size_t kBlock = 32;
using Block = std::array<std::array<float, kFilmChannelCount>, kBlock>;

}  // namespace

Film::Film(const TileRect& window, int display_width, int display_height)
    : window_(window),
      display_width_(display_width),
      display_height_(display_height),
      data_(window.area() * kFilmChannelCount, 0.0f) {}

void Film::Merge(const TileResult& result) {
    const TileRect& r = result.rect;
    if (r.empty() || !window_.Contains(r)) {
        ThrowInvalidArgument(
            fmt::format("tile {},{}..{},{} is not in the film", r.x0, r.y0, r.x1, r.y1));
    }
    const std::size_t n = result.pixels.size();
    if (result.planes.size() != n * kFilmChannelCount) {
        ThrowInvalidArgument(fmt::format("tile result has {} values for {} pixels, {} are due",
                                         result.planes.size(), n, n * kFilmChannelCount));
    }
    for (std::size_t k = 0; k < n; ++k) {
        if (result.pixels[k] >= r.area() || (k > 0 && result.pixels[k] <= result.pixels[k - 1])) {
            ThrowInvalidArgument("pixel indices of a tile result must rise and lie in the tile");
        }
    }
    // In blocks, copied plane by plane: the planes of one pixel lie at distances that share a cache
    // set, and pixel by pixel each access would miss.
    Block here, there;
    std::array<std::size_t, kBlock> at{};
    for (std::size_t begin = 0; begin < n; begin += kBlock) {
        const std::size_t count = std::min(kBlock, n - begin);
        for (std::size_t k = 0; k < count; ++k) {
            const int pixel = static_cast<int>(result.pixels[begin + k]);
            const int x = r.x0 - window_.x0 + pixel % r.width();
            const int y = r.y0 - window_.y0 + pixel / r.width();
            at[k] = static_cast<std::size_t>(y) * static_cast<std::size_t>(width()) +
                    static_cast<std::size_t>(x);
        }
        for (std::size_t c = 0; c < kFilmChannelCount; ++c) {
            const float* mine = data_.data() + c * pixel_count();
            const float* other = result.planes.data() + c * n + begin;
            for (std::size_t k = 0; k < count; ++k) {
                here[k][c] = mine[at[k]];
                there[k][c] = other[k];
            }
        }
        for (std::size_t k = 0; k < count; ++k) {
            PixelMoments moments = PixelMoments::Load(here[k].data(), 1);
            moments.Merge(PixelMoments::Load(there[k].data(), 1));
            moments.Store(here[k].data(), 1);
        }
        for (std::size_t c = 0; c < kFilmChannelCount; ++c) {
            float* mine = data_.data() + c * pixel_count();
            for (std::size_t k = 0; k < count; ++k) {
                mine[at[k]] = here[k][c];
            }
        }
    }
}

std::uint32_t Film::NextIndex(std::size_t i) const {
    return static_cast<std::uint32_t>(Plane(kCountA)[i] + Plane(kCountB)[i] + Plane(kBadCount)[i]);
}

Rgb Film::Mean(std::size_t i) const {
    const float a = Plane(kCountA)[i], b = Plane(kCountB)[i];
    if (a + b == 0) {
        return {};
    }
    Rgb mean;
    for (int c = 0; c < 3; ++c) {
        mean[c] = (a * Plane(kMeanA + c)[i] + b * Plane(kMeanB + c)[i]) / (a + b);
    }
    return mean;
}

Rgb Film::MeanVariance(std::size_t i) const {
    const float a = Plane(kCountA)[i], b = Plane(kCountB)[i];
    Rgb variance;
    if (a + b == 0) {
        return variance;
    }
    for (int c = 0; c < 3; ++c) {
        const float va = a > 1 ? Plane(kM2A + c)[i] * a / (a - 1) : 0;
        const float vb = b > 1 ? Plane(kM2B + c)[i] * b / (b - 1) : 0;
        variance[c] = (va + vb) / ((a + b) * (a + b));
    }
    return variance;
}

Rgb Film::HalfVariance(std::size_t i) const {
    const float a = Plane(kCountA)[i], b = Plane(kCountB)[i];
    Rgb variance;
    if (a == 0 || b == 0) {
        return variance;
    }
    const float scale = a * b / ((a + b) * (a + b));
    for (int c = 0; c < 3; ++c) {
        const float d = Plane(kMeanA + c)[i] - Plane(kMeanB + c)[i];
        variance[c] = d * d * scale;
    }
    return variance;
}

double Film::EstimateRelMSE(std::size_t i) const {
    const Rgb mean = Mean(i), variance = HalfVariance(i);
    double sum = 0;
    for (int c = 0; c < 3; ++c) {
        sum += variance[c] / (static_cast<double>(mean[c]) * mean[c] + kRelMSEEpsilon);
    }
    return sum / 3;
}

double Film::EstimateRelMSE() const {
    double sum = 0;
    for (std::size_t i = 0; i < pixel_count(); ++i) {
        sum += EstimateRelMSE(i);
    }
    return pixel_count() > 0 ? sum / static_cast<double>(pixel_count()) : 0;
}

double Film::TotalSamples() const {
    double sum = 0;
    for (std::size_t i = 0; i < pixel_count(); ++i) {
        sum += SampleCount(i);
    }
    return sum;
}

double Film::TotalBadSamples() const {
    double sum = 0;
    for (const float bad : Plane(kBadCount)) {
        sum += bad;
    }
    return sum;
}

}  // namespace relume
