#pragma once

#include <cmath>
#include <cstdint>

#include "core/film/film.h"
#include "core/film/moments.h"
#include "core/film/tile.h"

namespace relume {

// A stand-in for a path tracer: samples are a pure function of (pixel, index), with noise that
// differs from region to region, now and then a firefly and a NaN.
inline std::uint64_t Mix(std::uint64_t x) {  // splitmix64's finaliser
    x += 0x9e3779b97f4a7c15u;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return x ^ (x >> 31);
}

inline float PseudoUniform(int x, int y, std::uint32_t index, std::uint32_t dimension) {
    const std::uint64_t key =
        Mix(Mix(Mix(static_cast<std::uint64_t>(x)) + static_cast<std::uint64_t>(y)) +
            (std::uint64_t{index} << 8) + dimension);
    return static_cast<float>(key >> 40) * 0x1p-24f;
}

inline PixelSample PseudoSample(int x, int y, std::uint32_t index) {
    PixelSample sample;
    const float noise = (x / 8 + y / 8) % 3 == 0 ? 0.01f : 1.5f;
    for (int c = 0; c < 3; ++c) {
        sample.radiance[c] = 0.2f + 0.1f * static_cast<float>(c) +
                             noise * PseudoUniform(x, y, index, static_cast<std::uint32_t>(c));
    }
    const float luck = PseudoUniform(x, y, index, 10);
    if (luck < 0.003f) {
        sample.radiance[0] = 40;
    } else if (luck > 0.998f) {
        sample.radiance[1] = NAN;
    }
    sample.indirect_luminance = sample.radiance[0];
    for (std::size_t f = 0; f < kFeatureCount; ++f) {
        sample.features[f] = PseudoUniform(x, y, index, 20 + static_cast<std::uint32_t>(f));
    }
    return sample;
}

inline TileResult PseudoRender(const TileTask& task) {
    TileResult result;
    result.rect = task.rect;
    result.rays = 3 * task.TotalSamples();
    result.seconds = 1e-6 * static_cast<double>(task.TotalSamples());
    for (std::uint32_t i = 0; i < task.count.size(); ++i) {
        if (task.count[i] > 0) {
            result.pixels.push_back(i);
        }
    }
    result.planes.resize(result.pixels.size() * kFilmChannelCount);
    for (std::size_t k = 0; k < result.pixels.size(); ++k) {
        const auto i = static_cast<int>(result.pixels[k]);
        const int x = task.rect.x0 + i % task.rect.width(),
                  y = task.rect.y0 + i / task.rect.width();
        const std::uint32_t first = task.first[result.pixels[k]];
        PixelMoments moments;
        for (std::uint32_t s = 0; s < task.count[result.pixels[k]]; ++s) {
            moments.Add(first + s, PseudoSample(x, y, first + s));
        }
        moments.Store(result.planes.data() + k, result.pixels.size());
    }
    return result;
}

}  // namespace relume
