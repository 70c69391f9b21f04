// Denoising by Stein's unbiased risk estimate: Li, Wu, Chuang 2012 (methods 2.4). No parameters.
//
// A pixel becomes the weighted mean of its window. Weights fall with distance, sigma_s, and with
// the differences of normal, albedo and depth (over the frame's largest), each channel by itself in
// units of its noise: exp(-d^2 / (2 sigma_k^2 max(s_i + s_j, 1e-2))), s the variance of one sample,
// sigma_k = .8 normal, .25 albedo, .6 depth. Features that the frame lacks are left out.
//
// Seven windows, sigma_s = 1, sqrt(2), ..., 8 pixels (radius 2 sigma_s). Each pixel takes the one
// of least risk (F - y)^2 - v + 2 v dF/dy, smoothed by the weights of the widest window. As the
// authors' program has it, y and v are the image and its variance as their renderer's pixel filter,
// a Gaussian of radius 2, would make them of the same samples: that favours wide windows, but is
// far less noisy than the pixels themselves. The estimated error is plain SURE of the window that
// was taken, over a Gaussian of 4 pixels.
//
// What differs from the authors' program: samples count for their own pixel alone (box filter), so
// that y and v are found from the pixels' means.
//
// Planner: windows of 1, 2, 4 and 8 pixels, smoothed by a window of 4; a pixel asks for its
// window's (F - y)^2 + 2 v dF/dy over F^2 + 0.01 (luminance of F), smoothed likewise, over 1 + n;
// at least 1 and at most 1024 samples.
//
// sbf-gradient, the "improved SBF" of Xing, Chen, Li 2020 (Fig. 11; methods 2.4, 3.5): see
// sbf_gradient.cpp.
#include "server/denoise/sbf.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "server/denoise/bilateral_bank.h"
#include "server/denoise/planes.h"
#include "server/denoise/sbf_bank.h"
#include "server/denoise/sbf_gradient.h"
#include "server/denoise/share_samples.h"

namespace relume::denoise {
namespace {

constexpr int kFinalSmooth = 6, kPlanSmooth = 4;  // windows of 8 and 4 pixels
constexpr float kErrorBlur = 4;                   // pixels
constexpr int kPlanned[] = {0, 2, 4, 6};          // windows between passes
constexpr float kPriorityFloor = 1e-2f;
constexpr double kFewest = 1, kMost = 1024;  // samples that a plan gives a pixel

class Sbf final : public Denoiser {
  public:
    Sbf(bool gradient, const SbfKernels& kernels) : gradient_(gradient), kernels_(kernels) {}

    std::string Describe() const override { return gradient_ ? "sbf-gradient" : "sbf"; }

    Result Reconstruct(const Frame& frame, const CancelToken& cancel) const override {
        const SbfGuides guides = Guides(frame, cancel);
        const SbfTarget target = MakeSbfTarget(frame);
        SbfBank bank(frame, guides, target, kernels_);
        const std::size_t pixels = frame.pixel_count();
        Result result;
        for (Plane& plane : result.color) {
            plane.resize(pixels);
        }
        Plane own(pixels), sure(pixels);
        std::vector<std::size_t> chosen(static_cast<std::size_t>(bank.size()), 0);
        bank.ForEachBand(bank.Reach(kFinalSmooth), cancel, [&](int from, int to) {
            std::vector<const Plane*> risks;
            for (int k = 0; k < bank.size(); ++k) {
                risks.push_back(&bank[k].risk);
            }
            const auto smooth = bank.Smooth(risks, kFinalSmooth, from, to, cancel);
            const std::size_t first = static_cast<std::size_t>(from) * frame.width;
            const std::size_t skipped = static_cast<std::size_t>(from - bank.begin()) * frame.width;
            for (std::size_t i = 0; i < smooth[0].size(); ++i) {
                const std::size_t k = Least(smooth, smooth.size(), i);
                const SbfCandidate& best = bank[static_cast<int>(k)];
                ++chosen[k];
                own[first + i] = best.own[skipped + i];
                float error = 0;
                for (std::size_t c = 0; c < 3; ++c) {
                    const float filtered = best.filtered[c][skipped + i];
                    const float residual = filtered - frame.color[c][first + i];
                    result.color[c][first + i] = filtered;
                    error += residual * residual +
                             frame.variance[c][first + i] * (2 * own[first + i] - 1);
                }
                sure[first + i] = error * (1.0f / 3.0f);
            }
        });
        result.error = BlurGaussian(sure, frame.width, frame.height, kErrorBlur);
        result.derivative = {own, own, own};
        result.notes["features"] = guides.names.empty() ? "none" : guides.names;
        NoteShares(chosen, pixels, &result);
        return result;
    }

    Plane PlanSamples(const Frame& frame, double samples,
                      const CancelToken& cancel) const override {
        const SbfGuides guides = Guides(frame, cancel);
        const SbfTarget target = MakeSbfTarget(frame);
        SbfBank bank(frame, guides, target, kernels_);
        Plane priority(frame.pixel_count());
        bank.ForEachBand(bank.Reach(kPlanSmooth), cancel, [&](int from, int to) {
            std::vector<const Plane*> planes;
            std::vector<Plane> wanted;
            for (int kind = 0; kind < bank.size(); kind += kCandidates) {
                for (const int k : kPlanned) {
                    planes.push_back(&bank[kind + k].risk);
                    wanted.push_back(Priority(frame, target, bank[kind + k], bank.begin()));
                }
            }
            const std::size_t count = wanted.size();
            for (const Plane& plane : wanted) {
                planes.push_back(&plane);
            }
            const auto smooth = bank.Smooth(planes, kPlanSmooth, from, to, cancel);
            const std::size_t first = static_cast<std::size_t>(from) * frame.width;
            for (std::size_t i = 0; i < smooth[0].size(); ++i) {
                const float n = frame.count.empty() ? 0 : frame.count[first + i];
                priority[first + i] = smooth[count + Least(smooth, count, i)][i] / (1 + n);
            }
        });
        return ShareSamples(priority, samples, kFewest, kMost);
    }

  private:
    SbfGuides Guides(const Frame& frame, const CancelToken& cancel) const {
        SbfGuides guides = MakeSbfGuides(frame);
        if (gradient_) {
            AddGradientGuide(frame, cancel, &guides);
        }
        return guides;
    }

    // Which of the first `count` planes is least at i.
    static std::size_t Least(const std::vector<Plane>& planes, std::size_t count, std::size_t i) {
        std::size_t best = 0;
        for (std::size_t k = 1; k < count; ++k) {
            best = planes[k][i] < planes[best][i] ? k : best;
        }
        return best;
    }

    // (F - y)^2 + 2 v dF/dy, mean over RGB, over F^2 + floor, of a candidate whose rows begin at
    // `row`.
    static Plane Priority(const Frame& frame, const SbfTarget& target,
                          const SbfCandidate& candidate, int row) {
        const std::size_t first = static_cast<std::size_t>(row) * frame.width;
        Plane out(candidate.risk.size());
        for (std::size_t o = 0; o < out.size(); ++o) {
            float variance = 0;
            for (const Plane& plane : target.variance) {
                variance += plane[first + o] * (1.0f / 3.0f);
            }
            const auto& f = candidate.filtered;
            const float y = Luminance(Rgb{f[0][o], f[1][o], f[2][o]});
            out[o] = std::max(candidate.risk[o] + variance, 0.0f) / (y * y + kPriorityFloor);
        }
        return out;
    }

    static void NoteShares(const std::vector<std::size_t>& chosen, std::size_t pixels,
                           Result* result) {
        const double scale = pixels > 0 ? 100 / static_cast<double>(pixels) : 0;
        std::string& windows = result->notes["sigma_s"];
        for (std::size_t k = 0; k < kCandidates; ++k) {
            std::size_t count = 0;
            for (std::size_t c = k; c < chosen.size(); c += kCandidates) {
                count += chosen[c];
            }
            windows += fmt::format("{}{:.3g} px: {:.1f} %", k > 0 ? ", " : "",
                                   CandidateSigma(static_cast<int>(k)),
                                   static_cast<double>(count) * scale);
        }
        constexpr const char* kKinds[] = {"off", "1", "0.5"};
        for (std::size_t first = 0; first < chosen.size() && chosen.size() > kCandidates;
             first += kCandidates) {
            std::size_t count = 0;
            for (std::size_t k = 0; k < kCandidates; ++k) {
                count += chosen[first + k];
            }
            result->notes["sigma_g"] +=
                fmt::format("{}{}: {:.1f} %", first > 0 ? ", " : "", kKinds[first / kCandidates],
                            static_cast<double>(count) * scale);
        }
    }

    bool gradient_;
    const SbfKernels& kernels_;
};

}  // namespace

std::unique_ptr<Denoiser> MakeSbf(bool gradient, const SbfKernels& kernels) {
    return std::make_unique<Sbf>(gradient, kernels);
}

std::unique_ptr<Denoiser> MakeSbf(const ParamSet&) { return MakeSbf(false, BestSbfKernels()); }
std::unique_ptr<Denoiser> MakeSbfGradient(const ParamSet&) {
    return MakeSbf(true, BestSbfKernels());
}

}  // namespace relume::denoise
