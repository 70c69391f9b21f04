#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "core/base/cancel_token.h"
#include "server/denoise/nlm_weights.h"
#include "server/denoise/rd_features.h"
#include "server/denoise/rd_kernels.h"

namespace relume::denoise {

// One filter of robust denoising: weights are the least of those by colour and by each feature
// (methods 2.6, steps 3 and 4), a pixel's own weight is its neighbours' largest, at least 1e-3.
struct RdFilter {
    std::optional<NlmOptions> color;  // none: features alone. `symmetric` is taken for granted
    float tau;                        // least spread of a feature
};

// What all filters of a call share.
struct RdScene {
    const NlmGuide& guide;  // of colour distances
    const RdFeaturePlanes& features;
    int radius;
    bool with_sure, with_variance_share;
    std::vector<const Plane*>
        in;  // 3 to 6 planes; the first three are the guide's if SURE is wanted
};

struct RdFiltered {
    std::vector<Plane> out;  // as RdScene::in
    // With SURE: estimated squared error a pixel, and the derivative of a filtered pixel by its own
    // noisy value, both means over RGB.
    Plane sure, derivative;
    Plane variance_share;  // sum of w^2 / (sum of w)^2
};

// At most two different tau. Throws kCancelled soon after `cancel` is set.
std::vector<RdFiltered> ApplyRdFilters(const RdScene& scene, std::span<const RdFilter> filters,
                                       const CancelToken& cancel, const NlmKernels& kernels);

}  // namespace relume::denoise
