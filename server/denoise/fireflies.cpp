#include "server/denoise/fireflies.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/base/parallel.h"
#include "core/math/vec.h"
#include "server/denoise/halves.h"

namespace relume::denoise {
namespace {

constexpr int kAround = 2, kSpread = 3;  // radii of the neighbours, and of what is spread; pixels
constexpr float kTimesNoise = 6, kShareOfOneSample = 0.5f, kQuantile = 0.9f;

struct Window {
    int x0, y0, x1, y1;
};

Window WindowAround(const Frame& frame, int x, int y, int radius) {
    return {std::max(x - radius, 0), std::max(y - radius, 0), std::min(x + radius + 1, frame.width),
            std::min(y + radius + 1, frame.height)};
}

Plane LuminanceOf(const Plane (&color)[3]) {
    Plane out(color[0].size());
    for (std::size_t i = 0; i < out.size(); ++i) {
        out[i] = relume::Luminance({color[0][i], color[1][i], color[2][i]});
    }
    return out;
}

// Pixels of `luminance`, means of `count` samples whose variance is `variance`, that are fireflies.
std::vector<unsigned char> Find(const Frame& frame, const Plane& luminance, const Plane& variance,
                                const Plane& count) {
    std::vector<unsigned char> found(luminance.size(), 0);
    ParallelFor(0, static_cast<std::size_t>(frame.height), 8, [&](std::size_t y0, std::size_t y1) {
        std::vector<float> neighbours;
        for (int y = static_cast<int>(y0); y < static_cast<int>(y1); ++y) {
            for (int x = 0; x < frame.width; ++x) {
                const auto i = static_cast<std::size_t>(y) * static_cast<std::size_t>(frame.width) +
                               static_cast<std::size_t>(x);
                if (!(frame.brightest[i] > kShareOfOneSample * count[i] * luminance[i])) {
                    continue;
                }
                neighbours.clear();
                float noise = 0;
                const Window w = WindowAround(frame, x, y, kAround);
                for (int v = w.y0; v < w.y1; ++v) {
                    for (int u = w.x0; u < w.x1; ++u) {
                        const auto j =
                            static_cast<std::size_t>(v) * static_cast<std::size_t>(frame.width) +
                            static_cast<std::size_t>(u);
                        if (j != i) {
                            neighbours.push_back(luminance[j]);
                            noise += variance[j];
                        }
                    }
                }
                if (neighbours.size() < 3) {
                    continue;
                }
                const auto at =
                    neighbours.begin() + static_cast<std::ptrdiff_t>(
                                             kQuantile * static_cast<float>(neighbours.size() - 1));
                std::nth_element(neighbours.begin(), at, neighbours.end());
                noise /= static_cast<float>(neighbours.size());
                found[i] = luminance[i] > *at + kTimesNoise * std::sqrt(noise) ? 1 : 0;
            }
        }
    });
    return found;
}

// Mean of the pixels around pixel i that are not `found`; the pixel itself if all are.
float MeanAround(const Frame& frame, const std::vector<unsigned char>& found, const Plane& in,
                 std::size_t i) {
    const auto width = static_cast<std::size_t>(frame.width);
    const Window w =
        WindowAround(frame, static_cast<int>(i % width), static_cast<int>(i / width), kAround);
    float sum = 0, pixels = 0;
    for (int v = w.y0; v < w.y1; ++v) {
        for (int u = w.x0; u < w.x1; ++u) {
            const std::size_t j = static_cast<std::size_t>(v) * width + static_cast<std::size_t>(u);
            if (found[j] == 0) {
                sum += in[j];
                ++pixels;
            }
        }
    }
    return pixels > 0 ? sum / pixels : in[i];
}

// Replaces the pixels `found` by the mean of those around that are not, and spreads the rest.
void Spread(const Frame& frame, const std::vector<unsigned char>& found, Plane* plane) {
    const Plane in = *plane;
    const auto width = static_cast<std::size_t>(frame.width);
    for (std::size_t i = 0; i < in.size(); ++i) {
        if (found[i] == 0) {
            continue;
        }
        const float rest = in[i] - MeanAround(frame, found, in, i);
        (*plane)[i] -= rest;
        const Window s =
            WindowAround(frame, static_cast<int>(i % width), static_cast<int>(i / width), kSpread);
        const float each = rest / static_cast<float>((s.x1 - s.x0) * (s.y1 - s.y0));
        for (int v = s.y0; v < s.y1; ++v) {
            for (int u = s.x0; u < s.x1; ++u) {
                (*plane)[static_cast<std::size_t>(v) * width + static_cast<std::size_t>(u)] += each;
            }
        }
    }
}

// The variance of those pixels becomes the mean of their neighbours'.
void Calm(const Frame& frame, const std::vector<unsigned char>& found, Plane* variance) {
    const Plane in = *variance;
    for (std::size_t i = 0; i < in.size(); ++i) {
        (*variance)[i] = found[i] != 0 ? MeanAround(frame, found, in, i) : in[i];
    }
}

}  // namespace

std::size_t SpreadFireflies(Frame* frame) {
    if (frame->brightest.empty() || frame->count.empty()) {
        return 0;
    }
    const Plane variance = LuminanceOf(frame->variance);
    const auto found = Find(*frame, LuminanceOf(frame->color), variance, frame->count);
    const auto number = static_cast<std::size_t>(std::count(found.begin(), found.end(), 1));
    for (int c = 0; c < 3; ++c) {
        Spread(*frame, found, &frame->color[c]);
        Calm(*frame, found, &frame->variance[c]);
        Calm(*frame, found, &frame->sample_variance[c]);
    }
    for (int h = 0; h < 2 && frame->has_halves(); ++h) {
        Plane twice(variance), count(frame->count);
        for (std::size_t i = 0; i < count.size(); ++i) {
            count[i] = std::max(1.0f, HalfCount(frame->count[i], h));
            twice[i] *= std::max(frame->count[i], 1.0f) / count[i];
        }
        const auto in_half = Find(*frame, LuminanceOf(frame->half[h]), twice, count);
        for (int c = 0; c < 3; ++c) {
            Spread(*frame, in_half, &frame->half[h][c]);
        }
    }
    return number;
}

}  // namespace relume::denoise
