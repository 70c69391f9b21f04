#pragma once

#include <array>
#include <functional>

#include "core/base/cancel_token.h"
#include "server/denoise/frame.h"
#include "server/denoise/wlr_bandwidth.h"

namespace relume::denoise {

// A frame as weighted local regression sees it (methods 2.7).
struct WlrInput {
    int width, height;
    Plane plane[kWlrPlanes];  // WlrPlane; features that the frame lacks are 0
    Plane count;              // samples; empty: not known
};
WlrInput MakeWlrInput(const Frame& frame);

// Calls use(pixel, curves) for each pixel, on several threads: trial fits in windows of `radius`.
// Throws kCancelled soon after `cancel` is set.
void ForEachWlrPixel(const WlrInput& input, int radius, const WlrKernels& kernels,
                     const CancelToken& cancel,
                     const std::function<void(std::size_t, const WlrCurves&)>& use);

// The fit with each pixel's own bandwidth: kWlrFitPlanes planes.
std::array<Plane, kWlrFitPlanes> FitWlr(const WlrInput& input, int radius, const Plane& bandwidth,
                                        const WlrKernels& kernels, const CancelToken& cancel);

}  // namespace relume::denoise
