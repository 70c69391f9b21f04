#pragma once

#include <cstdint>
#include <vector>

#include "core/film/moments.h"
#include "core/film/tile.h"

namespace relume {

// Sample `index` of pixel `pixel`: arbitrary, but the same each time.
inline PixelSample MakeSample(std::uint32_t pixel, std::uint32_t index) {
    // PCG hash (Jarzynski and Olano, "Hash Functions for GPU Rendering", 2020) of each number, for
    // samples that are independent.
    const auto hash = [](std::uint32_t v) {
        v = v * 747796405u + 2891336453u;
        v = ((v >> ((v >> 28) + 4)) ^ v) * 277803737u;
        return (v >> 22) ^ v;
    };
    std::uint32_t state = hash(hash(pixel) + index);
    const auto next = [&] {
        state = hash(state);
        return static_cast<float>(state >> 8) / 16777216.0f;
    };
    PixelSample sample;
    for (int c = 0; c < 3; ++c) {
        sample.radiance[c] = 4 * next() * next();
    }
    sample.indirect_luminance = next();
    for (float& feature : sample.features) {
        feature = next();
    }
    return sample;
}

inline PixelMoments MakeMoments(std::uint32_t pixel, std::uint32_t first, std::uint32_t count) {
    PixelMoments moments;
    for (std::uint32_t i = first; i < first + count; ++i) {
        moments.Add(i, MakeSample(pixel, i));
    }
    return moments;
}

// What a worker would answer for the samples [first, first + count) of the given pixels of `rect`.
inline TileResult MakeResult(const TileRect& rect, const std::vector<std::uint32_t>& pixels,
                             std::uint32_t first, std::uint32_t count) {
    TileResult result;
    result.rect = rect;
    result.pixels = pixels;
    result.planes.resize(pixels.size() * kFilmChannelCount);
    for (std::size_t k = 0; k < pixels.size(); ++k) {
        // The number of the pixel in the frame, so that tiles of any size agree.
        const auto width = static_cast<std::uint32_t>(rect.width());
        const std::uint32_t x = static_cast<std::uint32_t>(rect.x0) + pixels[k] % width;
        const std::uint32_t y = static_cast<std::uint32_t>(rect.y0) + pixels[k] / width;
        MakeMoments(y * 1000 + x, first, count).Store(result.planes.data() + k, pixels.size());
    }
    return result;
}

inline std::vector<std::uint32_t> AllPixels(const TileRect& rect) {
    std::vector<std::uint32_t> pixels(rect.area());
    for (std::size_t i = 0; i < pixels.size(); ++i) {
        pixels[i] = static_cast<std::uint32_t>(i);
    }
    return pixels;
}

}  // namespace relume
