#pragma once

#include <array>
#include <vector>

#include "core/base/cancel_token.h"
#include "server/denoise/frame.h"
#include "server/denoise/nlm_weights.h"
#include "server/denoise/regression_kernels.h"

namespace relume::denoise {

// First-order collaborative regression with weights of non-local means (Bitterli et al. 2016,
// section 3; methods 2.8): in the 19x19 window of each pixel, clipped at the border, colour is
// fitted by weighted least squares as a linear function of x, y and the features, and the fit's
// values at all pixels of the window go into their means, with the same weights.
struct RegressionInput {
    NlmGuide guide;      // what the weights are taken from; its size is that of all planes
    NlmOptions weights;  // how
    std::vector<const Plane*> features;  // about 1 in size, at most kMaxRegressionFeatures
    std::array<const Plane*, 3> color;
};

// Variance in a window below which a feature counts as constant.
inline constexpr float kConstantVariance = 1e-6f;

// `results` fits, the first with weights of `input.weights`, each further one with half the k of
// the one before. The same bits for any number of threads and instruction set. Throws kCancelled
// soon after `cancel` is set.
std::vector<std::array<Plane, 3>> RegressFirstOrder(
    const RegressionInput& input, std::size_t results, const CancelToken& cancel,
    const RegressionKernels& kernels = BestRegressionKernels());

}  // namespace relume::denoise
