#pragma once

#include "core/base/cancel_token.h"
#include "server/denoise/frame.h"
#include "server/denoise/nlm_kernels.h"

namespace relume::denoise {

// A frame's features with their noise taken out, in the frame's units.
struct PrefilteredFeatures {
    Plane feature[kFeatureCount];   // empty if the frame lacks it
    Plane variance[kFeatureCount];  // that is left in it; 0 if there never was any; or as feature
};

// Non-local means on each of normal, albedo, depth and visibility by its own weights: Rousselle,
// Manzi, Zwicker 2013, section 5 (methods 2.6, step 2): k = 1, patch 3, radius 5 pixels. The
// variance of the mean has the shape of the samples' and the level of the halves'; what is left is
// the squared half difference of both halves filtered by the same weights, or, without halves, what
// the weights leave of it. A feature that has no variance anywhere (motionless, in focus, seen
// without a pixel filter; or none is known) is returned as it is, to the bit.
PrefilteredFeatures PrefilterFeatures(const Frame& frame, const CancelToken& cancel,
                                      const NlmKernels& kernels = BestNlmKernels());

// Squared half differences over 3x3 pixels, weights .1353, 1, .1353: those of single pixels are too
// noisy to weigh by.
Plane SmoothResidual(const Plane& variance, int width, int height);

}  // namespace relume::denoise
