// Greedy error minimisation: Rousselle, Knaus, Zwicker 2011 (methods 2.2).
//
//   gamma  trade between noise and blur, above 0, at most 0.5; more keeps more of both detail and
//          noise (default 0.2)
//
// Each pixel becomes its surroundings' mean over one of eight Gaussians, sigma = 0.7, 1, 1.4, ...,
// 8 pixels, or stays as it is. From fine to coarse, a step takes away variance, the gain, and adds
// squared bias, the loss: (c - f)^2 for the first step, else three times that (bias grows with the
// squared radius). A pixel stops before the first step for which z loss >= gain, z = -ln(1 - (1.9
// gamma)^(1/sqrt 2)) (1 - 1/N), N the samples in the coarse kernel, unless most of the pixels
// around it (a Gaussian of 2 sigma) go on. No features. The estimated error is the pixel's variance
// and what the steps taken added to it.
//
// What differs from the authors' program, on purpose: samples count for their own pixel alone (box
// filter), so that the finest image is the pixels themselves. A pixel that bright samples have
// missed looks free of noise by itself, and would stay dark: a variance is at least the mean of
// those of the 5x5 pixels around. The estimated error leaves out of a loss what the noise of c - f
// has in it, which on flat ground is as much as the gain. Sums are divided by what of a kernel lies
// in the image.
//
// Planner: the same with sigma = 1, 2, 4, 8 and the smoothed stops. The worst pixels, by error over
// mean^2 + 1e-3 times b/(b + N), get a batch of b = 4 samples each, spread by their Gaussian: in
// expectation, where the authors draw them. Where that would be more than a quarter of the pixels,
// the worst quarter gets larger batches.
//
// Limits: it knows no edges: what is finer than the noise is blurred or left noisy.
#include <fmt/format.h>

#include <algorithm>

#include "core/base/error.h"
#include "server/denoise/denoiser.h"
#include "server/denoise/gem_plan.h"
#include "server/denoise/gem_scales.h"

namespace relume::denoise {
namespace {

class Gem final : public Denoiser {
  public:
    explicit Gem(float gamma) : gamma_(gamma) {}

    std::string Describe() const override { return fmt::format("gem:gamma={:g}", gamma_); }

    Result Reconstruct(const Frame& frame, const CancelToken& cancel) const override {
        const GemScales scales = FinalGemScales(gamma_);
        GemSelection selection = SelectScales(frame, scales, cancel);
        Result result;
        for (std::size_t c = 0; c < 3; ++c) {
            result.color[c] = std::move(selection.mean[c]);
        }
        result.error = std::move(selection.error);
        result.derivative = {selection.own, selection.own, selection.own};
        std::string& shares = result.notes["sigma"];
        for (int s = -1; s < static_cast<int>(scales.sigma.size()); ++s) {
            const auto count = std::count(selection.scale.begin(), selection.scale.end(), s);
            const auto total = std::max<std::size_t>(selection.scale.size(), 1);
            const std::string name =
                s < 0 ? "none"
                      : fmt::format(", {:.3g} px", scales.sigma[static_cast<std::size_t>(s)]);
            shares += fmt::format("{}: {:.1f} %", name,
                                  100 * static_cast<double>(count) / static_cast<double>(total));
        }
        return result;
    }

    Plane PlanSamples(const Frame& frame, double samples,
                      const CancelToken& cancel) const override {
        const GemScales scales = PlanGemScales(gamma_);
        return PlanGemSamples(SelectScales(frame, scales, cancel), scales, frame.width,
                              frame.height, samples);
    }

  private:
    float gamma_;
};

}  // namespace

std::unique_ptr<Denoiser> MakeGem(const ParamSet& params) {
    const float gamma = params.GetFloat("gamma", 0.2f);
    if (!(gamma > 0 && gamma <= 0.5f)) {
        ThrowInvalidArgument(
            fmt::format("filter 'gem': gamma={:g} must be above 0 and at most 0.5", gamma));
    }
    return std::make_unique<Gem>(gamma);
}

}  // namespace relume::denoise
