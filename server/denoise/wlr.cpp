// Weighted local regression (Moon, Carr, Yoon 2014; methods 2.7). No parameters.
//
// A pixel's window of 19x19 is seen in the space of x, y, depth, normal and albedo, reduced to the
// principal components that stand out of the features' noise. A local quadratic fit says how the
// colour curves along each of them, and so how wide the kernel is in each against the others. Five
// local linear fits with kernels of rising width h say how bias and variance depend on it; the last
// fit takes the h of the least sum of both, smoothed over the neighbours. Neighbours whose grey
// differs by more than noise explains are left out.
//
// The estimated error is variance plus squared bias of the last fit. Planner: that error, from
// windows of 11x11, times what one more sample takes off it.
//
// Limits: its constants (the floor of the curvature, the weight 1 / max(variance, 1)) are of images
// whose white is about 1. That weight keeps fireflies down, and with them their energy: the image
// gets darker where variances are above 1. What features don't show is blurred as far as the greys
// allow. Visibility has no part.
#include "server/denoise/wlr_fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "server/denoise/denoiser.h"
#include "server/denoise/planes.h"
#include "server/denoise/share_samples.h"

namespace relume::denoise {
namespace {

constexpr float kSmooth = 1;  // pixels: of bandwidths, and of the plan
constexpr int kPlanRadius = 5;
// A pass gives a pixel no more than so many samples. Priorities above this quantile count as that.
constexpr double kMost = 1024, kQuantile = 0.95;
constexpr float kImportanceFloor = 0.001f;

class Wlr final : public Denoiser {
  public:
    std::string Describe() const override { return "wlr"; }

    Result Reconstruct(const Frame& frame, const CancelToken& cancel) const override {
        const std::size_t pixels = frame.pixel_count();
        const WlrInput input = MakeWlrInput(frame);
        Plane bandwidth(pixels), bias(pixels);
        std::vector<unsigned char> dimensions(pixels);
        ForEachWlrPixel(input, kWlrRadius, BestWlrKernels(), cancel,
                        [&](std::size_t i, const WlrCurves& curves) {
                            bandwidth[i] = static_cast<float>(curves.BestBandwidth());
                            bias[i] = static_cast<float>(curves.bias);
                            dimensions[i] = static_cast<unsigned char>(curves.dimensions);
                        });
        bandwidth = BlurGaussian(bandwidth, frame.width, frame.height, kSmooth);
        auto fit = FitWlr(input, kWlrRadius, bandwidth, BestWlrKernels(), cancel);
        Result result;
        for (std::size_t c = 0; c < 3; ++c) {
            result.color[c] = std::move(fit[kWlrValue + c]);
        }
        Plane error = std::move(fit[kWlrFitVariance]);
        double h_sum = 0, d_sum = 0;
        for (std::size_t i = 0; i < pixels; ++i) {
            const float h = bandwidth[i], b = bias[i] * h * h;
            error[i] += b * b;
            h_sum += h;
            d_sum += dimensions[i];
        }
        result.error = std::move(error);
        const double n = static_cast<double>(std::max<std::size_t>(pixels, 1));
        result.notes["bandwidth"] = fmt::format("{:.2f} in the mean", h_sum / n);
        result.notes["dimensions"] = fmt::format("{:.1f} in the mean", d_sum / n);
        return result;
    }

    // Error is n^(-4/(d+4)) for the best kernels of d dimensions: that share of it is to be had.
    Plane PlanSamples(const Frame& frame, double samples,
                      const CancelToken& cancel) const override {
        const WlrInput input = MakeWlrInput(frame);
        Plane priority(frame.pixel_count());
        ForEachWlrPixel(input, kPlanRadius, BestWlrKernels(), cancel,
                        [&](std::size_t i, const WlrCurves& curves) {
                            const double h = curves.BestBandwidth(), b = curves.bias * h * h;
                            const double grey = input.plane[kWlrGrey][i] + curves.offset + b;
                            priority[i] = static_cast<float>(
                                (curves.Variance(h) + b * b) *
                                std::pow(curves.count, -4.0 / (curves.dimensions + 4)) /
                                (grey * grey + kImportanceFloor));
                        });
        priority = BlurGaussian(priority, frame.width, frame.height, kSmooth);
        if (!priority.empty()) {
            Plane sorted = priority;
            const auto place =
                sorted.begin() +
                static_cast<std::ptrdiff_t>(kQuantile * static_cast<double>(sorted.size() - 1));
            std::nth_element(sorted.begin(), place, sorted.end());
            for (float& value : priority) {
                value = std::min(value, *place);
            }
        }
        return ShareSamples(priority, samples, 0, kMost);
    }
};

}  // namespace

std::unique_ptr<Denoiser> MakeWlr(const ParamSet&) { return std::make_unique<Wlr>(); }

}  // namespace relume::denoise
