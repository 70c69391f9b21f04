#pragma once

#include "server/denoise/wlr_kernels.h"

namespace relume::denoise {

// One pixel's trial fits: the t-th has bandwidth TrialBandwidth(t).
struct WlrTrials {
    double change[kWlrTrials];    // filtered less noisy value, mean over RGB
    double variance[kWlrTrials];  // of the filtered value
    int dimensions;
    double count;  // samples of the pixel
};

constexpr double TrialBandwidth(int t) { return 0.2 * (t + 1); }

// How bias and variance depend on the bandwidth h (Moon et al. 2014, section 5; methods 2.7, step
// 5).
struct WlrCurves {
    double offset, bias;   // change = offset + bias h^2; the offset is the pixel's own noise
    double floor, spread;  // count x variance = floor + spread / h^dimensions
    int dimensions;
    double count;

    double Variance(double h) const;
    // Of least squared error, between 0.01 and 1.
    double BestBandwidth() const;
};

WlrCurves FitCurves(const WlrTrials& trials);

}  // namespace relume::denoise
