#include <fmt/format.h>

#include <cmath>

#include "server/denoise/bilateral.h"
#include "server/denoise/bilateral_bank.h"
#include "server/denoise/cancelled.h"
#include "server/denoise/planes.h"

namespace relume::denoise {
namespace {

constexpr float kSureBlur =
    4;  // pixels: SURE of a single pixel is too noisy to choose by (methods 1.5)

class CorrectedBilateral final : public Denoiser {
  public:
    explicit CorrectedBilateral(const BilateralKernels& kernels) : kernels_(kernels) {}

    std::string Describe() const override { return "bilateral:mode=corrected"; }

    Result Reconstruct(const Frame& frame, const CancelToken& cancel) const override {
        CandidateBank bank = ComputeBank(frame, kernels_, cancel);
        const std::size_t pixels = frame.pixel_count();
        Result result;
        Plane best(pixels, INFINITY);
        std::vector<unsigned char> choice(pixels, 0);
        std::size_t chosen[kCandidates] = {};
        for (int k = 0; k < kCandidates; ++k) {
            ThrowIfCancelled(cancel);
            const Plane smooth = BlurGaussian(bank.sure[k], frame.width, frame.height, kSureBlur);
            for (std::size_t i = 0; i < pixels; ++i) {
                if (smooth[i] < best[i]) {
                    best[i] = smooth[i];
                    choice[i] = static_cast<unsigned char>(k);
                }
            }
        }
        for (Plane& plane : result.color) {
            plane.resize(pixels);
        }
        Plane own(pixels);
        for (std::size_t i = 0; i < pixels; ++i) {
            ++chosen[choice[i]];
            own[i] = bank.self[choice[i]][i];
            for (int c = 0; c < 3; ++c) {
                result.color[c][i] = bank.filtered[choice[i]][c][i];
            }
        }
        result.derivative = {own, own, own};
        result.error = std::move(best);
        result.notes["features"] = bank.features.empty() ? "none" : bank.features;
        std::string& shares = result.notes["sigma_s"];
        for (int k = 0; k < kCandidates; ++k) {
            const double share =
                pixels > 0 ? static_cast<double>(chosen[k]) / static_cast<double>(pixels) : 0;
            shares += fmt::format("{}{:.3g} px: {:.1f} %", k > 0 ? ", " : "", CandidateSigma(k),
                                  100 * share);
        }
        return result;
    }

  private:
    const BilateralKernels& kernels_;
};

}  // namespace

std::unique_ptr<Denoiser> MakeCorrectedBilateral(const BilateralKernels& kernels) {
    return std::make_unique<CorrectedBilateral>(kernels);
}

}  // namespace relume::denoise
