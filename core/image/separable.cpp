#include "core/image/separable.h"

#include <algorithm>

#include "core/base/parallel.h"

namespace relume {
namespace {

constexpr std::size_t kRowsPerTask = 16;

}  // namespace

Plane CorrelateSeparable(const Plane& in, int width, std::span<const double> kernel_x,
                         std::span<const double> kernel_y) {
    const auto w = static_cast<std::size_t>(width);
    const std::size_t h = in.size() / w;
    Plane rows(in.size(), 0.0), out(in.size(), 0.0);
    ParallelFor(0, h, kRowsPerTask, [&](std::size_t y0, std::size_t y1) {
        const std::size_t radius = kernel_x.size() / 2;
        Plane padded(w + 2 * radius);
        for (std::size_t y = y0; y < y1; ++y) {
            const double* from = &in[y * w];
            std::fill_n(padded.begin(), radius, from[0]);
            std::copy_n(from, w, padded.begin() + static_cast<std::ptrdiff_t>(radius));
            std::fill_n(padded.end() - static_cast<std::ptrdiff_t>(radius), radius, from[w - 1]);
            double* to = &rows[y * w];
            for (std::size_t k = 0; k < kernel_x.size(); ++k) {
                for (std::size_t x = 0; x < w; ++x) {
                    to[x] += kernel_x[k] * padded[x + k];
                }
            }
        }
    });
    ParallelFor(0, h, kRowsPerTask, [&](std::size_t y0, std::size_t y1) {
        const std::size_t radius = kernel_y.size() / 2;
        for (std::size_t y = y0; y < y1; ++y) {
            double* to = &out[y * w];
            for (std::size_t k = 0; k < kernel_y.size(); ++k) {
                const std::size_t from_row = std::min(std::max(y + k, radius) - radius, h - 1);
                const double* from = &rows[from_row * w];
                for (std::size_t x = 0; x < w; ++x) {
                    to[x] += kernel_y[k] * from[x];
                }
            }
        }
    });
    return out;
}

}  // namespace relume
