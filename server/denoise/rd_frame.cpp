#include "server/denoise/rd_frame.h"

#include <algorithm>
#include <cmath>

#include "server/denoise/feature_prefilter.h"
#include "server/denoise/halves.h"
#include "server/denoise/nlm_filter.h"

namespace relume::denoise {
namespace {

constexpr int kSecondRadius = 5;
constexpr int kErrorRadius = 1, kChoiceRadius = 5;

constexpr RdFilter kSecondFilter = {NlmOptions{.patch = 3, .own_variance = true}, 1e-4f};

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

Candidates MakeCandidates(const Frame& frame, const RdFeaturePlanes& features, int radius,
                          const NlmKernels& kernels, const CancelToken& cancel) {
    const NlmGuide guide = ColorGuide(frame);
    RdScene scene{guide,
                  features,
                  radius,
                  true,
                  !frame.has_halves(),
                  {&frame.color[0], &frame.color[1], &frame.color[2]}};
    Plane difference[3];
    if (frame.has_halves()) {
        HalfDifference(frame, difference);
        scene.in.insert(scene.in.end(), {&difference[0], &difference[1], &difference[2]});
    }
    return ApplyRdFilters(scene, kRdCandidateFilters, cancel, kernels);
}

// Of each pixel how much of each candidate to take, 1 in all; `error`: their smoothed SURE.
std::vector<Plane> ChooseCandidates(const Frame& frame, const Candidates& candidates,
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
    FilterNlm(ColorGuide(frame), kRdSmoothing, kErrorRadius, sure, smoothed, cancel, kernels);
    for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
        std::size_t best = (*error)[kFeatures][i] < (*error)[kSmooth][i] ? kFeatures : kSmooth;
        if ((*error)[kFine][i] < (*error)[best][i] &&
            candidates[kFine].derivative[i] <= candidates[kSmooth].derivative[i]) {
            best = kFine;
        }
        choice[best][i] = 1;
    }
    FilterNlm(ColorGuide(frame), kRdSmoothing, kChoiceRadius, chosen, shares, cancel, kernels);
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

}  // namespace

RdFrame FilterRdFrame(const Frame& frame, const RdFeaturePlanes& features, int radius,
                      const NlmKernels& kernels, const CancelToken& cancel) {
    RdFrame out;
    Blended blended;
    {
        const Candidates candidates = MakeCandidates(frame, features, radius, kernels, cancel);
        std::vector<Plane> error;
        out.share = ChooseCandidates(frame, candidates, kernels, cancel, &error);
        blended = Blend(frame, candidates, out.share, error);
    }
    const NlmGuide guide(frame.width, frame.height, blended.color, blended.variance);
    const RdScene scene{guide, features, kSecondRadius,
                        false, false,    {&blended.color[0], &blended.color[1], &blended.color[2]}};
    RdFiltered last = std::move(ApplyRdFilters(scene, {&kSecondFilter, 1}, cancel, kernels)[0]);

    for (std::size_t c = 0; c < 3; ++c) {
        out.color[c] = std::move(last.out[c]);
    }
    out.error = std::move(blended.error);
    return out;
}

}  // namespace relume::denoise
