#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "server/denoise/bilateral.h"
#include "server/denoise/bilateral_robust_bank.h"
#include "server/denoise/cancelled.h"
#include "server/denoise/planes.h"

namespace relume::denoise {
namespace {

constexpr float kSureBlur = 4;  // pixels (methods 1.5)
constexpr float kMixBlur = 8;   // pixels: a share that is noisy lets noise through
// How far the blur of SURE reaches. The candidates are made kBandRows at a time.
constexpr int kBlurReach = 12, kBandRows = 2 * kPairHeight;

// Of each pixel the candidate with the least smoothed SURE.
struct Chosen {
    std::array<Plane, 3> filtered, own;  // as RobustCandidate
    std::array<Plane, 3> importance;
    std::size_t count[kRobustCandidates] = {};
    std::string features;
};

// Chooses for rows [from, to), all of whose blur windows lie in the bank.
void ChooseRows(const Frame& frame, const RobustBank& bank, int from, int to, Chosen* chosen) {
    const auto width = static_cast<std::size_t>(frame.width);
    const auto first = static_cast<std::size_t>(from) * width;
    const auto skipped = static_cast<std::size_t>(from - bank.begin()) * width;
    const std::size_t pixels = static_cast<std::size_t>(to - from) * width;
    Plane best(pixels, INFINITY);
    std::vector<unsigned char> choice(pixels, 0);
    for (int k = 0; k < kRobustCandidates; ++k) {
        const Plane smooth =
            BlurGaussian(bank[k].sure, frame.width, bank.end() - bank.begin(), kSureBlur);
        for (std::size_t i = 0; i < pixels; ++i) {
            if (smooth[skipped + i] < best[i]) {
                best[i] = smooth[skipped + i];
                choice[i] = static_cast<unsigned char>(k);
            }
        }
    }
    for (std::size_t i = 0; i < pixels; ++i) {
        ++chosen->count[choice[i]];
        const RobustCandidate& candidate = bank[choice[i]];
        for (std::size_t c = 0; c < 3; ++c) {
            chosen->filtered[c][first + i] = candidate.filtered[c][skipped + i];
            chosen->own[c][first + i] = candidate.own[c][skipped + i];
        }
    }
}

Chosen ChooseWindows(const Frame& frame, const BilateralKernels& kernels,
                     const CancelToken& cancel) {
    RobustBank bank(frame, kernels, cancel);
    Chosen chosen;
    chosen.features = bank.features();
    for (std::size_t c = 0; c < 3; ++c) {
        chosen.filtered[c].resize(frame.pixel_count());
        chosen.own[c].resize(frame.pixel_count());
    }
    for (int done = 0; done < frame.height;) {
        bank.Extend(std::min(bank.end() + kBandRows, frame.height), cancel);
        const int ready = bank.end() == frame.height ? frame.height : bank.end() - kBlurReach;
        ChooseRows(frame, bank, done, ready, &chosen);
        done = ready;
        bank.Drop(std::max(bank.begin(), done - kBlurReach));
    }
    chosen.importance = bank.importance();
    return chosen;
}

// How much of the filtered image to take, 0 to 1: the a that makes the surroundings' SURE of y + a
// (F - y) least (methods 3.7).
Plane FilteredShare(const Frame& frame, const Chosen& chosen) {
    Plane noise(frame.pixel_count()), change(frame.pixel_count());
    for (std::size_t i = 0; i < noise.size(); ++i) {
        for (std::size_t c = 0; c < 3; ++c) {
            const float d = chosen.filtered[c][i] - frame.color[c][i];
            const float importance = chosen.importance[c][i];
            change[i] += importance * d * d;
            noise[i] += importance * frame.variance[c][i] * (1 - chosen.own[c][i]);
        }
    }
    Plane share = BlurGaussian(noise, frame.width, frame.height, kMixBlur);
    change = BlurGaussian(change, frame.width, frame.height, kMixBlur);
    for (std::size_t i = 0; i < share.size(); ++i) {
        share[i] = share[i] < change[i] ? std::max(share[i] / change[i], 0.0f) : 1.0f;
    }
    return share;
}

class RobustBilateral final : public Denoiser {
  public:
    explicit RobustBilateral(const BilateralKernels& kernels) : kernels_(kernels) {}

    std::string Describe() const override { return "bilateral:mode=robust"; }

    Result Reconstruct(const Frame& frame, const CancelToken& cancel) const override {
        Chosen chosen = ChooseWindows(frame, kernels_, cancel);
        ThrowIfCancelled(cancel);
        const Plane share = FilteredShare(frame, chosen);
        const std::size_t pixels = frame.pixel_count();
        Result result;
        result.derivative.emplace();
        Plane error(pixels);
        double taken = 0;
        for (std::size_t c = 0; c < 3; ++c) {
            result.color[c].resize(pixels);
            (*result.derivative)[c].resize(pixels);
            for (std::size_t i = 0; i < pixels; ++i) {
                const float y = frame.color[c][i];
                const float change = share[i] * (chosen.filtered[c][i] - y);
                const float own = 1 - share[i] + share[i] * chosen.own[c][i];
                const float sure = change * change + frame.variance[c][i] * (2 * own - 1);
                result.color[c][i] = y + change;
                (*result.derivative)[c][i] = own;
                error[i] += sure * (1.0f / 3.0f);
            }
        }
        result.error = BlurGaussian(error, frame.width, frame.height, kSureBlur);
        result.notes["features"] = chosen.features.empty() ? "none" : chosen.features;
        for (const float a : share) {
            taken += a;
        }
        const double scale = pixels > 0 ? 100 / static_cast<double>(pixels) : 0;
        result.notes["filtered"] = fmt::format("{:.1f} %", taken * scale);
        std::string& shares = result.notes["sigma_s"];
        for (int k = 0; k < kCandidates; ++k) {
            shares += fmt::format("{}{:.3g} px: {:.1f} + {:.1f} %", k > 0 ? ", " : "",
                                  CandidateSigma(k), static_cast<double>(chosen.count[k]) * scale,
                                  static_cast<double>(chosen.count[kCandidates + k]) * scale);
        }
        return result;
    }

  private:
    const BilateralKernels& kernels_;
};

}  // namespace

std::unique_ptr<Denoiser> MakeRobustBilateral(const BilateralKernels& kernels) {
    return std::make_unique<RobustBilateral>(kernels);
}

}  // namespace relume::denoise
