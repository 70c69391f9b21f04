#pragma once

#include <array>

#include "server/denoise/denoiser.h"
#include "server/denoise/frame.h"

namespace relume::denoise {

// RelMSE (epsilon 0.01) of an image, estimated without a reference.
struct ErrorEstimate {
    double relmse = 0;
    double margin = 0;  // half the width of its 95 % interval
    Plane map;          // a pixel; unsmoothed: mostly noise, and may be negative
};

// Squared errors a pixel and channel over `reference`^2 + 0.01; `noise` is the variance that they
// were estimated from. `reference` is an image nearer the truth than the noisy one: a pixel that is
// bright or dark by chance must not be its own yardstick.
ErrorEstimate EstimateError(const std::array<const Plane*, 3>& squared_error,
                            const std::array<const Plane*, 3>& noise,
                            const std::array<const Plane*, 3>& reference);

}  // namespace relume::denoise
