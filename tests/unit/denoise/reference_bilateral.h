#pragma once

#include "server/denoise/frame.h"

namespace relume::denoise {

// The bilateral filter's equations in double, a pixel at a time: what the kernels must agree with.

struct ReferenceResult {
    Plane color[3], sure;
};

// Corrected mode's candidate with sigma_s (methods 2.4, 3.4, 1.5).
ReferenceResult ReferenceCorrected(const Frame& frame, double sigma_s);

// Robust mode's candidate with sigma_s (methods 3.7), whose `sure` is left 0. `ranged`: with the
// range factor.
ReferenceResult ReferenceRobust(const Frame& frame, double sigma_s, bool ranged);

// Printed mode with sigma_s (methods 3.4 to 3.6); `taylor` 0 = (14) directly. The truncated series
// is computed as the Gaussian times the Poisson distribution's sum, not as a series of powers.
ReferenceResult ReferencePrinted(const Frame& frame, double sigma_s, int taylor);

}  // namespace relume::denoise
