#pragma once

#include <cstddef>

#include "core/base/parallel.h"
#include "server/denoise/frame.h"

namespace relume::denoise {

// body(i) for each of `size` pixels, on several threads.
template <class Body>
void ForEachPixel(std::size_t size, Body body) {
    constexpr std::size_t kPixels = 4096;  // a task
    ParallelFor(0, size, kPixels, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            body(i);
        }
    });
}

// A plane of value(i).
template <class Value>
Plane FillPlane(std::size_t size, Value value) {
    Plane plane(size);
    ForEachPixel(size, [&](std::size_t i) { plane[i] = value(i); });
    return plane;
}

// The lesser; `most` also for what is no number.
inline float AtMost(float most, float x) { return x < most ? x : most; }

}  // namespace relume::denoise
