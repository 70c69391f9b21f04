#include "server/denoise/regression.h"

#include <algorithm>
#include <cstring>

#include "core/base/parallel.h"
#include "server/denoise/bilateral_tiles.h"
#include "server/denoise/cancelled.h"

namespace relume::denoise {
namespace {

constexpr int kHalo = kRegressionRadius;
constexpr int kStride = kRegressionTileWidth + 2 * kHalo;
constexpr int kRows = kRegressionTileHeight + 2 * kHalo;
// Planes a multiple of 4096 bytes apart would share few places of the processor's cache.
constexpr int kPlaneSize = (kStride * kRows + 1023) / 1024 * 1024 + 5 * 16;

// Of a normalised column: weak enough to leave ramps alone, strong enough for normal equations in
// float.
constexpr float kRidge = 1e-4f;
constexpr float kLargestColor = 1e12f, kLargestFeature = 1e4f;  // no sum overflows

// One thread's memory.
struct Scratch {
    NlmWeights nlm;
    AlignedFloats planes, sums, weights;

    Scratch(const RegressionInput& input)
        : nlm(input.weights, kRegressionRadius, kRegressionTileWidth, kRegressionTileHeight),
          planes((input.features.size() + 3) * kPlaneSize),
          sums(4 * kPlaneSize),
          weights(kRegressionWeights) {}

    float* Plane(std::size_t index) {
        return planes.data() + index * kPlaneSize + kHalo * (kStride + 1);
    }
    float* Sum(std::size_t index) {
        return sums.data() + index * kPlaneSize + kHalo * (kStride + 1);
    }
};

void LoadTile(const Plane& from, int width, int height, const TileRect& tile, float largest,
              float* to) {
    const int x0 = std::max(tile.x0 - kHalo, 0);
    const int x1 = std::min(tile.x0 + kRegressionTileWidth + kHalo, width);
    for (int y = -kHalo; y < kRegressionTileHeight + kHalo; ++y) {
        float* row = to + y * kStride;
        std::fill_n(row - kHalo, kStride, 0.0f);
        if (tile.y0 + y >= 0 && tile.y0 + y < height) {
            const float* source = from.data() + static_cast<std::size_t>(tile.y0 + y) *
                                                    static_cast<std::size_t>(width);
            for (int x = x0; x < x1; ++x) {
                row[x - tile.x0] = std::clamp(source[x], -largest, largest);
            }
        }
    }
}

void CopyWeights(const float* from, std::ptrdiff_t stride, const TileRect& tile, int dx, int dy,
                 float* to) {
    constexpr std::size_t kGroupBytes = kRegressionGroup * sizeof(float);
    const int whole = tile.width() / kRegressionGroup * kRegressionGroup;
    for (int y = 0; y < tile.height(); ++y, from += stride) {
        for (int x = 0; x < whole; x += kRegressionGroup) {
            std::memcpy(to + WeightIndex(x, y, dx, dy), from + x, kGroupBytes);
        }
        std::copy(from + whole, from + tile.width(), to + WeightIndex(whole, y, dx, dy));
    }
}

void ComputeWeights(const TileRect& tile, Scratch* scratch) {
    float* weights = scratch->weights.data();
    if (tile.width() < kRegressionTileWidth) {
        std::fill_n(weights, kRegressionWeights, 0.0f);
    }
    const std::vector<float> ones(kRegressionTileWidth, 1.0f);
    CopyWeights(ones.data(), 0, tile, 0, 0, weights);
    for (const auto& [dx, dy] : HalfWindow(kRegressionRadius)) {
        scratch->nlm.ComputeWeights(dx, dy);
        CopyWeights(scratch->nlm.forward(), scratch->nlm.stride(), tile, dx, dy, weights);
        CopyWeights(scratch->nlm.backward(), scratch->nlm.stride(), tile, -dx, -dy, weights);
    }
}

// Sums of one regression over the frame: of predictions, a channel, and of weights.
using Sums = std::array<Plane, 4>;

void AddTile(const TileRect& tile, int width, int height, Scratch* scratch, Sums* total) {
    const int x0 = std::max(tile.x0 - kHalo, 0), x1 = std::min(tile.x1 + kHalo, width);
    for (std::size_t s = 0; s < 4; ++s) {
        for (int y = std::max(tile.y0 - kHalo, 0); y < std::min(tile.y1 + kHalo, height); ++y) {
            const float* from = scratch->Sum(s) + (y - tile.y0) * kStride - tile.x0;
            float* to =
                (*total)[s].data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(width);
            for (int x = x0; x < x1; ++x) {
                to[x] += from[x];
            }
        }
    }
}

}  // namespace

std::vector<std::array<Plane, 3>> RegressFirstOrder(const RegressionInput& input,
                                                    std::size_t results, const CancelToken& cancel,
                                                    const RegressionKernels& kernels) {
    const int width = input.guide.width, height = input.guide.height;
    const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    std::vector<Sums> sums(results);
    for (Sums& of_result : sums) {
        for (Plane& plane : of_result) {
            plane.assign(pixels, 0.0f);
        }
    }
    const auto run = [&](const TileRect& tile, Scratch* scratch) {
        RegressionTile task = {};
        task.width = tile.width();
        task.height = tile.height();
        task.features = static_cast<int>(input.features.size());
        task.stride = task.sum_stride = kStride;
        task.ridge = kRidge;
        task.floor = kConstantVariance;
        task.weights = scratch->weights.data();
        for (std::size_t f = 0; f < input.features.size(); ++f) {
            LoadTile(*input.features[f], width, height, tile, kLargestFeature, scratch->Plane(f));
            task.feature[f] = scratch->Plane(f);
        }
        for (std::size_t c = 0; c < 3; ++c) {
            float* to = scratch->Plane(input.features.size() + c);
            LoadTile(*input.color[c], width, height, tile, kLargestColor, to);
            task.color[c] = to;
        }
        for (std::size_t s = 0; s < 4; ++s) {
            task.sum[s] = scratch->Sum(s);
        }
        scratch->nlm.Load(input.guide, tile);
        ComputeWeights(tile, scratch);
        for (std::size_t r = 0; r < results; ++r) {
            if (r > 0) {
                kernels.sharpen(scratch->weights.data(), kRegressionWeights);
            }
            std::fill_n(scratch->sums.data(), 4 * kPlaneSize, 0.0f);
            kernels.regress(task);
            AddTile(tile, width, height, scratch, &sums[r]);
        }
    };
    // Tiles add to their surroundings: every other one in x and in y at a time, so that no two meet
    // and each pixel's sum has one order.
    const int across = (width + kRegressionTileWidth - 1) / kRegressionTileWidth;
    const int down = (height + kRegressionTileHeight - 1) / kRegressionTileHeight;
    for (int color = 0; color < 4; ++color) {
        const int first_x = color % 2, first_y = color / 2;
        const int columns = (across - first_x + 1) / 2, rows = (down - first_y + 1) / 2;
        ParallelFor(0, static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows), 1,
                    [&](std::size_t begin, std::size_t end) {
                        Scratch scratch(input);
                        for (std::size_t t = begin; t < end; ++t) {
                            ThrowIfCancelled(cancel);
                            const int i = static_cast<int>(t);
                            const int x0 = (2 * (i % columns) + first_x) * kRegressionTileWidth;
                            const int y0 = (2 * (i / columns) + first_y) * kRegressionTileHeight;
                            run({x0, y0, std::min(x0 + kRegressionTileWidth, width),
                                 std::min(y0 + kRegressionTileHeight, height)},
                                &scratch);
                        }
                    });
    }
    std::vector<std::array<Plane, 3>> out(results);
    for (std::size_t r = 0; r < results; ++r) {
        for (std::size_t c = 0; c < 3; ++c) {
            out[r][c] = std::move(sums[r][c]);
            for (std::size_t i = 0; i < pixels; ++i) {
                out[r][c][i] /= sums[r][3][i];  // at least 1: the pixel's own
            }
        }
    }
    return out;
}

}  // namespace relume::denoise
