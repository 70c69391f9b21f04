#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "server/denoise/bilateral.h"
#include "server/denoise/bilateral_tiles.h"
#include "server/denoise/planes.h"

namespace relume::denoise {
namespace {

// Section 4.1 of the paper: range sigma in linear radiance, feature sigmas of normal, texture,
// depth.
constexpr float kRangeSigma = 8;
constexpr float kFeatureSigma[3] = {0.4f, 0.125f, 0.3f};
constexpr int kSteps = 7;        // sigma_s = 1, sqrt(2), ..., 8
constexpr float kErrorBlur = 4;  // pixels, for the error map alone

struct Filtered {
    Plane color[9];  // all samples, half a, half b: one set of weights
};

PrintedTables MakeTables(float sigma_s, int taylor) {
    PrintedTables tables{};
    tables.sigma_s = sigma_s;
    tables.taylor = taylor;
    for (int y = 0; y <= kPrintedRadius; ++y) {
        for (int x = 0; x <= kPrintedRadius; ++x) {
            tables.inverse_distance[y][x] =
                x == 0 && y == 0 ? 0 : 1 / std::sqrt(static_cast<float>(x * x + y * y));
        }
    }
    tables.range_scale = 1 / (2 * kRangeSigma * kRangeSigma);
    for (int g = 0; g < 3; ++g) {
        tables.feature_scale[g] = 1 / (2 * kFeatureSigma[g] * kFeatureSigma[g]);
    }
    return tables;
}

// Squared error a pixel from the halves, mean over RGB (methods 2.8, step 3): each half's filtered
// image against the other half, whose own variance is twice that of the mean.
Plane HalfBufferError(const Frame& frame, const Filtered& filtered) {
    Plane error(frame.pixel_count());
    const auto square = [](float x) { return x * x; };
    for (std::size_t i = 0; i < error.size(); ++i) {
        float sum = 0;
        for (int c = 0; c < 3; ++c) {
            const float fa = filtered.color[3 + c][i], fb = filtered.color[6 + c][i];
            sum += 0.5f * (square(frame.half[1][c][i] - fa) + square(frame.half[0][c][i] - fb)) -
                   2 * frame.variance[c][i] - 0.25f * square(fb - fa);
        }
        error[i] = sum * (1.0f / 3.0f);
    }
    return error;
}

double Mean(const Plane& plane) {
    double sum = 0;
    for (const float value : plane) {
        sum += value;
    }
    return plane.empty() ? 0 : sum / static_cast<double>(plane.size());
}

class PrintedBilateral final : public Denoiser {
  public:
    PrintedBilateral(int taylor, const BilateralKernels& kernels)
        : taylor_(taylor), kernels_(kernels) {}

    std::string Describe() const override {
        return fmt::format("bilateral:mode=printed,taylor={}", taylor_);
    }

    Needs GetNeeds() const override { return {.halves = true}; }

    Result Reconstruct(const Frame& frame, const CancelToken& cancel) const override {
        const Guides guides = MakeGuides(frame);
        const Plane gradient = SobelMagnitude(frame);
        // One sigma_s for the frame, raised while the estimated error falls.
        Filtered best;
        Plane best_error;
        double best_mean = INFINITY;
        int step = 0;
        for (; step < kSteps; ++step) {
            Filtered filtered = Filter(frame, guides, gradient, Sigma(step), cancel);
            Plane error = HalfBufferError(frame, filtered);
            const double mean = Mean(error);
            if (step > 0 && !(mean < best_mean)) {
                break;
            }
            best = std::move(filtered);
            best_error = std::move(error);
            best_mean = mean;
        }
        Result result;
        for (int c = 0; c < 3; ++c) {
            result.color[c] = std::move(best.color[c]);
        }
        result.error = BlurGaussian(best_error, frame.width, frame.height, kErrorBlur);
        result.notes["features"] = guides.names.empty() ? "none" : guides.names;
        result.notes["sigma_s"] = fmt::format("{:.3g}", Sigma(step - 1));
        return result;
    }

  private:
    static float Sigma(int step) { return std::exp2(0.5f * static_cast<float>(step)); }

    Filtered Filter(const Frame& frame, const Guides& guides, const Plane& gradient, float sigma_s,
                    const CancelToken& cancel) const {
        Filtered filtered;
        for (Plane& plane : filtered.color) {
            plane.resize(frame.pixel_count());
        }
        const PrintedTables tables = MakeTables(sigma_s, taylor_);
        ForEachTile(frame, kPrintedPlanes, kPrintedRadius, cancel,
                    [&](const TileArea& tile, TilePlanes& scratch) {
                        const auto load = [&](int index, const Plane& plane, float outside = 0) {
                            scratch.Load(index, plane, frame.width, frame.height, tile.x0, tile.y0,
                                         outside);
                        };
                        for (int c = 0; c < 3; ++c) {
                            load(kPrintedColor + c, frame.color[c]);
                            load(kPrintedColor + 3 + c, frame.half[0][c]);
                            load(kPrintedColor + 6 + c, frame.half[1][c]);
                            load(kPrintedVariance + c, guides.variance[c]);
                        }
                        for (int f = 0; f < 7; ++f) {
                            load(kPrintedNormal + f, guides.feature[f], f == 6 ? kOutside : 0);
                        }
                        load(kPrintedGradient, gradient);
                        std::vector<float> out(static_cast<std::size_t>(9 * kTileArea));
                        kernels_.printed(scratch.planes(), scratch.stride(), tables, tile.height,
                                         out.data());
                        for (int c = 0; c < 9; ++c) {
                            for (int y = 0; y < tile.height; ++y) {
                                std::copy_n(
                                    out.data() + c * kTileArea + y * kTileWidth, tile.width,
                                    filtered.color[c].data() +
                                        static_cast<std::size_t>(tile.y0 + y) * frame.width +
                                        tile.x0);
                            }
                        }
                    });
        return filtered;
    }

    int taylor_;
    const BilateralKernels& kernels_;
};

}  // namespace

Plane SobelMagnitude(const Frame& frame) {
    const Plane grey = AverageOfThree(frame.color);
    Plane out(grey.size());
    for (int y = 0; y < frame.height; ++y) {
        for (int x = 0; x < frame.width; ++x) {
            const auto at = [&](int dx, int dy) {
                const int u = std::clamp(x + dx, 0, frame.width - 1);
                const int v = std::clamp(y + dy, 0, frame.height - 1);
                return grey[static_cast<std::size_t>(v) * frame.width +
                            static_cast<std::size_t>(u)];
            };
            const float across =
                at(1, -1) + 2 * at(1, 0) + at(1, 1) - at(-1, -1) - 2 * at(-1, 0) - at(-1, 1);
            const float down =
                at(-1, 1) + 2 * at(0, 1) + at(1, 1) - at(-1, -1) - 2 * at(0, -1) - at(1, -1);
            out[static_cast<std::size_t>(y) * frame.width + static_cast<std::size_t>(x)] =
                std::sqrt(across * across + down * down);
        }
    }
    return out;
}

std::unique_ptr<Denoiser> MakePrintedBilateral(int taylor, const BilateralKernels& kernels) {
    return std::make_unique<PrintedBilateral>(taylor, kernels);
}

}  // namespace relume::denoise
