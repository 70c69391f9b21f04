#pragma once

#include <cstdint>
#include <vector>

#include "core/film/sample_records.h"

namespace relume {

// Pixels [x0,x1) x [y0,y1) of the full image, y down.
struct TileRect {
    int x0 = 0, y0 = 0, x1 = 0, y1 = 0;

    int width() const { return x1 - x0; }
    int height() const { return y1 - y0; }
    std::size_t area() const { return static_cast<std::size_t>(width()) * height(); }
    bool empty() const { return x1 <= x0 || y1 <= y0; }
    bool Contains(const TileRect& r) const {
        return r.x0 >= x0 && r.y0 >= y0 && r.x1 <= x1 && r.y1 <= y1;
    }
    friend bool operator==(const TileRect&, const TileRect&) = default;
};

// What to render: for each pixel of `rect`, row-major, the samples [first, first + count).
// Count 0: the pixel is not sampled.
struct TileTask {
    TileRect rect;
    std::vector<std::uint32_t> first;
    std::vector<std::uint32_t> count;
    bool keep_samples = false;  // the result is to hold the samples themselves, too

    std::uint64_t TotalSamples() const;
    std::size_t ActivePixels() const;
};

// Cuts `window` into tiles of at most `size` x `size` pixels in row-major order.
std::vector<TileRect> CutIntoTiles(const TileRect& window, int size);

// What was rendered: `planes` holds film channels (aov.h), each for the active pixels (count > 0)
// of the task in row-major order, plane after plane.
struct TileResult {
    TileRect rect;
    std::vector<std::uint32_t> pixels;  // indices into rect, row-major, rising
    std::vector<float> planes;          // kFilmChannelCount x pixels.size()
    std::uint64_t rays = 0;             // traced for it
    double seconds = 0;                 // thread time it took
    // Of a task with keep_samples: each pixel's, in order of their index, pixel after pixel.
    std::vector<SampleRecord> samples;
};

}  // namespace relume
