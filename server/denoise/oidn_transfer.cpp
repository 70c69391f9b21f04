// Curves and exposure of Open Image Denoise 2 (methods 5.1).
#include "server/denoise/oidn_transfer.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/base/parallel.h"

namespace relume::denoise {
namespace {

constexpr float kA = 1412.83765f, kB = 1.64593172f, kC = 0.431384981f, kD = -0.00294139609f,
                kE = 0.192653254f, kF = 0.00626026094f, kG = 0.998620152f;
constexpr float kX0 = 1.5794576e-6f, kX1 = 0.0322087631f;
const float kY0 = kA * kX0, kY1 = kB * std::pow(kX1, kC) + kD;

float Pu(float x) {
    if (x <= kX0) {
        return kA * x;
    }
    return x <= kX1 ? kB * std::pow(x, kC) + kD : kE * std::log(x + kF) + kG;
}

const float kPuOfLargest = Pu(65504);

constexpr int kBlock = 16;
constexpr float kBlack = 1e-8f;
constexpr float kKey = 0.18f;

}  // namespace

float ToPu(float radiance) { return Pu(std::max(radiance, 0.0f)) / kPuOfLargest; }

float FromPu(float y) {
    y = std::max(y, 0.0f) * kPuOfLargest;
    if (y <= kY0) {
        return y / kA;
    }
    return y <= kY1 ? std::pow((y - kD) / kB, 1 / kC) : std::exp((y - kG) / kE) - kF;
}

float ToSrgb(float linear) {
    return linear <= 0.0031308f ? 12.92f * linear : 1.055f * std::pow(linear, 1 / 2.4f) - 0.055f;
}

float FromSrgb(float y) {
    return y <= 0.04045f ? y / 12.92f : std::pow((y + 0.055f) / 1.055f, 2.4f);
}

float AutoExposure(const Plane (&color)[3], int width, int height) {
    const auto columns = static_cast<std::size_t>((width + kBlock - 1) / kBlock);
    const auto rows = static_cast<std::size_t>((height + kBlock - 1) / kBlock);
    const auto w = static_cast<std::size_t>(width), h = static_cast<std::size_t>(height);
    std::vector<double> log_sums(rows);
    std::vector<int> counts(rows);
    ParallelFor(0, rows, 1, [&](std::size_t begin, std::size_t end) {
        for (std::size_t row = begin; row < end; ++row) {
            const std::size_t y0 = row * h / rows, y1 = (row + 1) * h / rows;
            for (std::size_t column = 0; column < columns; ++column) {
                const std::size_t x0 = column * w / columns, x1 = (column + 1) * w / columns;
                float sum = 0;
                for (std::size_t y = y0; y < y1; ++y) {
                    for (std::size_t x = x0; x < x1; ++x) {
                        const std::size_t i = y * w + x;
                        sum += 0.212671f * std::max(color[0][i], 0.0f) +
                               0.715160f * std::max(color[1][i], 0.0f) +
                               0.072169f * std::max(color[2][i], 0.0f);
                    }
                }
                const float mean = sum / static_cast<float>((y1 - y0) * (x1 - x0));
                if (mean > kBlack) {
                    log_sums[row] += std::log2(static_cast<double>(mean));
                    ++counts[row];
                }
            }
        }
    });
    double sum = 0;
    int count = 0;
    for (std::size_t row = 0; row < rows; ++row) {
        sum += log_sums[row];
        count += counts[row];
    }
    return count == 0 ? 1.0f : kKey / static_cast<float>(std::exp2(sum / count));
}

}  // namespace relume::denoise
