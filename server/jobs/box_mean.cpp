#include "server/jobs/box_mean.h"

#include <algorithm>

#include "core/base/clones.h"
#include "core/base/parallel.h"

namespace relume::jobs {
namespace {

constexpr std::size_t kBox = 21;  // pixels a side: seven times three
constexpr std::size_t kRadius = kBox / 2;

// Sums of kBox neighbours: out[i] = in[i] + ... + in[i + kBox - 1], each a row of `width` values,
// by way of sums of three, which are left in `in`. No running sums: what a firefly adds to one and
// takes out again would leave a trace. `in` has `count` + kBox - 1 rows.
RELUME_CLONES void BoxSums(std::size_t count, std::size_t width, double* __restrict in,
                           double* __restrict out) {
    for (std::size_t i = 0; i < (count + kBox - 3) * width; ++i) {
        in[i] += in[i + width] + in[i + 2 * width];
    }
    const std::size_t w3 = 3 * width;
    for (std::size_t i = 0; i < count * width; ++i) {
        out[i] = in[i] + in[i + w3] + in[i + 2 * w3] + in[i + 3 * w3] + in[i + 4 * w3] +
                 in[i + 5 * w3] + in[i + 6 * w3];
    }
}

// The same for boxes of any size, one sum after the other: thin images are small.
void LongBoxSums(std::size_t count, std::size_t width, std::size_t box, const double* in,
                 double* out) {
    for (std::size_t i = 0; i < count * width; ++i) {
        out[i] = 0;
        for (std::size_t k = 0; k < box; ++k) {
            out[i] += in[i + k * width];
        }
    }
}

// Along a side of an image whose other side is `across` pixels: the box is longer where that is
// less than kBox, so that it has as many pixels as elsewhere.
std::size_t RadiusAlong(std::size_t across) {
    return across >= kBox ? kRadius : kBox * kBox / across / 2;
}

}  // namespace

std::vector<float> BoxMean(const std::vector<float>& plane, int width, int height) {
    const auto w = static_cast<std::size_t>(width), h = static_cast<std::size_t>(height);
    if (plane.empty()) {
        return {};
    }
    const std::size_t radius_x = RadiusAlong(h), radius_y = RadiusAlong(w);
    const auto sums_of = [](std::size_t count, std::size_t line, std::size_t radius, double* in,
                            double* out) {
        if (radius == kRadius) {
            BoxSums(count, line, in, out);
        } else {
            LongBoxSums(count, line, 2 * radius + 1, in, out);
        }
    };
    // Pixels of a line of `size` that the box at `i` covers.
    const auto covered = [](std::size_t i, std::size_t size, std::size_t radius) {
        return std::min(size - 1, i + radius) - (i - std::min(i, radius)) + 1;
    };
    std::vector<double> rows(plane.size());
    ParallelFor(0, h, 16, [&](std::size_t y0, std::size_t y1) {
        std::vector<double> padded, sums(w);
        for (std::size_t y = y0; y < y1; ++y) {
            padded.assign(w + 2 * radius_x, 0.0);
            std::copy_n(plane.begin() + static_cast<std::ptrdiff_t>(y * w), w,
                        padded.begin() + static_cast<std::ptrdiff_t>(radius_x));
            sums_of(w, 1, radius_x, padded.data(), sums.data());
            std::copy(sums.begin(), sums.end(), rows.begin() + static_cast<std::ptrdiff_t>(y * w));
        }
    });
    std::vector<float> mean(plane.size());
    ParallelFor(0, w, 32, [&](std::size_t x0, std::size_t x1) {
        const std::size_t strip = x1 - x0;
        std::vector<double> padded((h + 2 * radius_y) * strip, 0.0), sums(h * strip);
        for (std::size_t y = 0; y < h; ++y) {
            std::copy_n(rows.begin() + static_cast<std::ptrdiff_t>(y * w + x0), strip,
                        padded.begin() + static_cast<std::ptrdiff_t>((y + radius_y) * strip));
        }
        sums_of(h, strip, radius_y, padded.data(), sums.data());
        for (std::size_t y = 0; y < h; ++y) {
            for (std::size_t k = 0; k < strip; ++k) {
                const auto pixels =
                    static_cast<double>(covered(x0 + k, w, radius_x) * covered(y, h, radius_y));
                mean[y * w + x0 + k] = static_cast<float>(sums[y * strip + k] / pixels);
            }
        }
    });
    return mean;
}

}  // namespace relume::jobs
