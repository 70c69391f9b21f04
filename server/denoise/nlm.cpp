// Non-local means on two halves: Rousselle, Knaus, Zwicker 2012 (methods 2.3). No parameters.
//
// A pixel becomes the weighted mean of its 21x21 window; a neighbour's weight falls with the
// distance of the patches of 7x7 pixels around both (nlm_weights.h), k = 0.45, with the pairwise
// symmetric trick; weights become their mean over 7x7, and 0 below 0.05. Each half is filtered by
// weights from the other one, so that a weight knows nothing of the noise that it weighs. No
// features.
//
// The variance is the frame's, which has the level of the halves' difference (methods 1.2,
// estimator 3; Rousselle, Manzi, Zwicker 2013). The paper of 2012 smooths that difference over 3x3
// pixels instead: with few samples patches then meet variances near 0, and hardly anything is
// filtered.
//
// Estimated error: the variance by the difference of the filtered halves. What the filter blurs is
// not in it. A frame without halves is filtered by its own weights, and the error is what they
// leave of its variance.
//
// Planner: samples go where the filtered halves differ, 2 (F_a - F_b)^2 / (F^2 + 1e-3) over their
// filtered counts, with the paper's settings between passes: 15x15 window, alpha = 1/2.
//
// Limits: shadows and textures below the noise are blurred, as no feature shows them; a pixel that
// is brighter than anything like it (a firefly) stays.
#include "server/denoise/nlm.h"

#include <algorithm>
#include <array>

#include "server/denoise/halves.h"
#include "server/denoise/nlm_filter.h"
#include "server/denoise/planes.h"
#include "server/denoise/share_samples.h"

namespace relume::denoise {
namespace {

struct Pass {
    int radius;
    float alpha;
};
constexpr Pass kFinalPass = {10, 1}, kPlanningPass = {7, 0.5f};
constexpr float kPlanBlur = 0.8f;  // pixels
constexpr float kEpsilon = 1e-3f;
constexpr double kMostOfMean =
    8;  // samples of a pixel in a plan, of their mean: the paper has no figure

NlmOptions OptionsOf(Pass pass) {
    return {.alpha = pass.alpha, .symmetric = true, .weight_patch = 3, .least_weight = 0.05f};
}

struct FilteredHalf {
    Plane color[3], count;
};

// Samples of a half, and how many times its variance is the frame's.
struct HalfSamples {
    Plane count, variance_ratio;
};

HalfSamples SamplesOf(const Frame& frame, int half) {
    HalfSamples out;
    out.count.resize(frame.pixel_count());
    out.variance_ratio.resize(frame.pixel_count());
    for (std::size_t i = 0; i < out.count.size(); ++i) {
        const float n = frame.count.empty() ? 2 : std::max(frame.count[i], 1.0f);
        out.count[i] = HalfCount(n, half);
        out.variance_ratio[i] = n / std::max(out.count[i], 1.0f);
    }
    return out;
}

std::array<FilteredHalf, 2> FilterBoth(const Frame& frame, Pass pass, const NlmKernels& kernels,
                                       const CancelToken& cancel) {
    const HalfSamples samples[2] = {SamplesOf(frame, 0), SamplesOf(frame, 1)};
    std::array<FilteredHalf, 2> out;
    for (int h = 0; h < 2; ++h) {
        const int other = 1 - h;
        Plane variance[3];
        for (int c = 0; c < 3; ++c) {
            variance[c] = frame.variance[c];
            for (std::size_t i = 0; i < variance[c].size(); ++i) {
                variance[c][i] *= samples[other].variance_ratio[i];
            }
        }
        FilteredHalf& half = out[static_cast<std::size_t>(h)];
        const Plane(&from)[3] = frame.half[h];
        FilterNlm({frame.width, frame.height, frame.half[other], variance}, OptionsOf(pass),
                  pass.radius, std::vector{&from[0], &from[1], &from[2], &samples[h].count},
                  std::vector{&half.color[0], &half.color[1], &half.color[2], &half.count}, cancel,
                  kernels);
    }
    return out;
}

class Nlm final : public Denoiser {
  public:
    explicit Nlm(const NlmKernels& kernels) : kernels_(kernels) {}

    std::string Describe() const override { return "nlm"; }

    Result Reconstruct(const Frame& frame, const CancelToken& cancel) const override {
        return frame.has_halves() ? ByHalves(frame, cancel) : ByItself(frame, cancel);
    }

    Plane PlanSamples(const Frame& frame, double samples,
                      const CancelToken& cancel) const override {
        if (!frame.has_halves()) {
            return {};
        }
        const auto halves = FilterBoth(frame, kPlanningPass, kernels_, cancel);
        Plane error(frame.pixel_count());
        for (const FilteredHalf& half : halves) {
            for (std::size_t i = 0; i < error.size(); ++i) {
                float sum = 0;
                for (std::size_t c = 0; c < 3; ++c) {
                    const float d = halves[0].color[c][i] - halves[1].color[c][i];
                    sum += 2 * d * d / (kEpsilon + half.color[c][i] * half.color[c][i]);
                }
                error[i] += sum / (3 * std::max(half.count[i], 1.0f));
            }
        }
        const double most = kMostOfMean * samples / static_cast<double>(error.size());
        return ShareSamples(BlurGaussian(error, frame.width, frame.height, kPlanBlur), samples, 0,
                            most);
    }

  private:
    Result ByHalves(const Frame& frame, const CancelToken& cancel) const {
        const auto halves = FilterBoth(frame, kFinalPass, kernels_, cancel);
        Result result;
        result.notes["weights"] = "from the other half";
        result.error.emplace(frame.pixel_count());
        for (std::size_t c = 0; c < 3; ++c) {
            result.color[c].resize(frame.pixel_count());
            for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
                const float n = frame.count.empty() ? 2 : std::max(frame.count[i], 1.0f);
                const float a = HalfCount(n, 0) / n;
                const float fa = halves[0].color[c][i], fb = halves[1].color[c][i];
                result.color[c][i] = a * fa + (1 - a) * fb;
                (*result.error)[i] += a * (1 - a) * (fa - fb) * (fa - fb) * (1.0f / 3.0f);
            }
        }
        return result;
    }

    Result ByItself(const Frame& frame, const CancelToken& cancel) const {
        Result result;
        result.notes["weights"] = "from the image itself";
        Plane share;
        FilterNlm({frame.width, frame.height, frame.color, frame.variance}, OptionsOf(kFinalPass),
                  kFinalPass.radius, std::vector{&frame.color[0], &frame.color[1], &frame.color[2]},
                  std::vector{&result.color[0], &result.color[1], &result.color[2]}, cancel,
                  kernels_, &share);
        result.error = AverageOfThree(frame.variance);
        for (std::size_t i = 0; i < share.size(); ++i) {
            (*result.error)[i] *= share[i];
        }
        return result;
    }

    const NlmKernels& kernels_;
};

}  // namespace

std::unique_ptr<Denoiser> MakeNlm(const NlmKernels& kernels) {
    return std::make_unique<Nlm>(kernels);
}

std::unique_ptr<Denoiser> MakeNlm(const ParamSet&) { return MakeNlm(BestNlmKernels()); }

}  // namespace relume::denoise
