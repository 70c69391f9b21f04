// Robust denoising by features and colour: Rousselle, Manzi, Zwicker 2013 (methods 2.6). No
// parameters.
//
// A pixel becomes the weighted mean of its 21x21 window. A neighbour's weight is the least of those
// by colour (patch distances, nlm_weights.h, k = 0.45) and by each feature (prefiltered,
// feature_prefilter.h; k = 0.6), so that any of them can keep an edge; the pairwise symmetric trick
// is on. Three candidates:
//   fine     patches of 3x3 pixels, least spread of a feature 1e-3
//   smooth   patches of 7x7 pixels, 1e-3
//   features no colour, 1e-4
// Each has its SURE, with the derivative by filtering again with the pixel's own value 1 % larger
// in all channels, as their noise goes together. SURE is smoothed over 3x3 by colour (k = 1, patch
// 7x7), each pixel takes the candidate of least SURE (fine: only where its derivative is not above
// that of smooth), and the choice is smoothed over 11x11. What comes out is filtered once more, as
// smooth but over 11x11 with 1e-4, by the variance that the halves, filtered alike, show to be
// left.
//
// Features: normal, albedo, depth (the paper has the position), visibility; those that the frame
// lacks are left out, and so is the paper's caustic buffer. Without halves (or of a half) the
// variance that is left is what the weights leave of the frame's.
//
// Estimated error: the chosen candidates' smoothed SURE, before the last filtering.
//
// Planner: max(0, SURE) of fine, over F^2 + 1e-2 and its filtered count, smoothed over 21x21 by
// colour.
//
// Limits: SURE is for Gaussian noise; where a few bright samples make the noise, some of their
// energy is lost.
#include "server/denoise/rd.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "server/denoise/feature_prefilter.h"
#include "server/denoise/halves.h"
#include "server/denoise/nlm_filter.h"
#include "server/denoise/rd_filter.h"
#include "server/denoise/share_samples.h"

namespace relume::denoise {
namespace {

constexpr int kRadius = 10, kSecondRadius = 5;
constexpr int kErrorRadius = 1, kChoiceRadius = 5;
constexpr double kMostOfMean = 8;  // samples of a pixel in a plan, as nlm

enum Candidate { kFine, kSmooth, kFeatures, kRdCandidates };
constexpr RdFilter kCandidateFilters[kRdCandidates] = {
    {NlmOptions{.patch = 1}, 1e-3f}, {NlmOptions{.patch = 3}, 1e-3f}, {std::nullopt, 1e-4f}};
constexpr RdFilter kSecondFilter = {NlmOptions{.patch = 3, .own_variance = true}, 1e-4f};
constexpr NlmOptions kSmoothing = {.k = 1};

NlmGuide GuideOf(const Frame& frame) {
    return {frame.width, frame.height, frame.color, frame.variance};
}

// Half the difference of the halves, times what makes its square estimate the variance of the
// frame's mean also where they differ in samples.
void HalfDifference(const Frame& frame, Plane (&out)[3]) {
    for (int c = 0; c < 3; ++c) {
        out[c].resize(frame.pixel_count());
        for (std::size_t i = 0; i < out[c].size(); ++i) {
            const float n = frame.count.empty() ? 2 : std::max(frame.count[i], 1.0f);
            const float share = HalfCount(n, 0) * HalfCount(n, 1) / (n * n);
            out[c][i] = (frame.half[0][c][i] - frame.half[1][c][i]) * std::sqrt(share);
        }
    }
}

using Candidates = std::vector<RdFiltered>;

Candidates MakeCandidates(const Frame& frame, const RdFeaturePlanes& features,
                          const NlmKernels& kernels, const CancelToken& cancel) {
    const NlmGuide guide = GuideOf(frame);
    RdScene scene{guide,
                  features,
                  kRadius,
                  true,
                  !frame.has_halves(),
                  {&frame.color[0], &frame.color[1], &frame.color[2]}};
    Plane difference[3];
    if (frame.has_halves()) {
        HalfDifference(frame, difference);
        scene.in.insert(scene.in.end(), {&difference[0], &difference[1], &difference[2]});
    }
    return ApplyRdFilters(scene, kCandidateFilters, cancel, kernels);
}

// Of each pixel how much of each candidate to take, 1 in all; `error`: their smoothed SURE.
std::vector<Plane> Choose(const Frame& frame, const Candidates& candidates,
                          const NlmKernels& kernels, const CancelToken& cancel,
                          std::vector<Plane>* error) {
    std::vector<Plane> choice(kRdCandidates, Plane(frame.pixel_count())), share(kRdCandidates);
    error->resize(kRdCandidates);
    std::vector<const Plane*> sure, chosen;
    std::vector<Plane*> smoothed, shares;
    for (std::size_t k = 0; k < kRdCandidates; ++k) {
        sure.push_back(&candidates[k].sure);
        smoothed.push_back(&(*error)[k]);
        chosen.push_back(&choice[k]);
        shares.push_back(&share[k]);
    }
    FilterNlm(GuideOf(frame), kSmoothing, kErrorRadius, sure, smoothed, cancel, kernels);
    for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
        std::size_t best = (*error)[kFeatures][i] < (*error)[kSmooth][i] ? kFeatures : kSmooth;
        if ((*error)[kFine][i] < (*error)[best][i] &&
            candidates[kFine].derivative[i] <= candidates[kSmooth].derivative[i]) {
            best = kFine;
        }
        choice[best][i] = 1;
    }
    FilterNlm(GuideOf(frame), kSmoothing, kChoiceRadius, chosen, shares, cancel, kernels);
    for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
        float sum = 0;
        for (const Plane& plane : share) {
            sum += plane[i];
        }
        for (Plane& plane : share) {
            plane[i] /= sum;
        }
    }
    return share;
}

struct Blended {
    Plane color[3], variance[3], error;
};

Blended Blend(const Frame& frame, const Candidates& candidates, const std::vector<Plane>& share,
              const std::vector<Plane>& error) {
    Blended out;
    out.error.resize(frame.pixel_count());
    for (std::size_t k = 0; k < candidates.size(); ++k) {
        for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
            out.error[i] += share[k][i] * error[k][i];
        }
    }
    for (std::size_t c = 0; c < 3; ++c) {
        out.color[c].resize(frame.pixel_count());
        out.variance[c].resize(frame.pixel_count());
        for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
            float color = 0, left = 0;
            for (std::size_t k = 0; k < candidates.size(); ++k) {
                const RdFiltered& from = candidates[k];
                color += share[k][i] * from.out[c][i];
                left += share[k][i] *
                        (frame.has_halves() ? from.out[3 + c][i] : from.variance_share[i]);
            }
            out.color[c][i] = color;
            out.variance[c][i] = frame.has_halves() ? left * left : left * frame.variance[c][i];
        }
        out.variance[c] = SmoothResidual(out.variance[c], frame.width, frame.height);
    }
    return out;
}

class Rd final : public Denoiser {
  public:
    explicit Rd(const NlmKernels& kernels) : kernels_(kernels) {}

    std::string Describe() const override { return "rd"; }

    Result Reconstruct(const Frame& frame, const CancelToken& cancel) const override {
        const RdFeaturePlanes features =
            MakeRdFeatures(frame, PrefilterFeatures(frame, cancel, kernels_));
        std::vector<Plane> share;
        Blended blended;
        {
            const Candidates candidates = MakeCandidates(frame, features, kernels_, cancel);
            std::vector<Plane> error;
            share = Choose(frame, candidates, kernels_, cancel, &error);
            blended = Blend(frame, candidates, share, error);
        }
        const NlmGuide guide(frame.width, frame.height, blended.color, blended.variance);
        const RdScene scene{
            guide, features, kSecondRadius,
            false, false,    {&blended.color[0], &blended.color[1], &blended.color[2]}};
        RdFiltered last =
            std::move(ApplyRdFilters(scene, {&kSecondFilter, 1}, cancel, kernels_)[0]);

        Result result;
        for (std::size_t c = 0; c < 3; ++c) {
            result.color[c] = std::move(last.out[c]);
        }
        result.error = std::move(blended.error);
        result.notes["features"] = features.names.empty() ? "none" : features.names;
        result.notes["candidates"] =
            fmt::format("fine {:.1f} %, smooth {:.1f} %, features {:.1f} %", Percent(share[kFine]),
                        Percent(share[kSmooth]), Percent(share[kFeatures]));
        return result;
    }

    Plane PlanSamples(const Frame& frame, double samples,
                      const CancelToken& cancel) const override {
        const RdFeaturePlanes features =
            MakeRdFeatures(frame, PrefilterFeatures(frame, cancel, kernels_));
        const NlmGuide guide = GuideOf(frame);
        Plane count = frame.count;
        count.resize(frame.pixel_count(), 1.0f);
        const RdScene scene{guide,   features,
                            kRadius, true,
                            false,   {&frame.color[0], &frame.color[1], &frame.color[2], &count}};
        const RdFiltered fine =
            std::move(ApplyRdFilters(scene, {&kCandidateFilters[kFine], 1}, cancel, kernels_)[0]);
        Plane error(frame.pixel_count()), smooth;
        for (std::size_t i = 0; i < error.size(); ++i) {
            const float mean = (fine.out[0][i] + fine.out[1][i] + fine.out[2][i]) * (1.0f / 3.0f);
            error[i] = std::max(fine.sure[i], 0.0f) /
                       ((1e-2f + mean * mean) * std::max(fine.out[3][i], 1.0f));
        }
        FilterNlm(guide, kSmoothing, kRadius, std::vector<const Plane*>{&error},
                  std::vector{&smooth}, cancel, kernels_);
        return ShareSamples(smooth, samples, 0,
                            kMostOfMean * samples / static_cast<double>(error.size()));
    }

  private:
    static double Percent(const Plane& share) {
        double sum = 0;
        for (const float s : share) {
            sum += s;
        }
        return share.empty() ? 0 : 100 * sum / static_cast<double>(share.size());
    }

    const NlmKernels& kernels_;
};

}  // namespace

std::unique_ptr<Denoiser> MakeRd(const NlmKernels& kernels) {
    return std::make_unique<Rd>(kernels);
}

std::unique_ptr<Denoiser> MakeRd(const ParamSet&) { return MakeRd(BestNlmKernels()); }

}  // namespace relume::denoise
