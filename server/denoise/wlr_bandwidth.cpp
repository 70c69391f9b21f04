#include "server/denoise/wlr_bandwidth.h"

#include <algorithm>
#include <cmath>

namespace relume::denoise {
namespace {

constexpr double kLeast = 0.01, kLargest = 1;

struct Line {
    double intercept, slope;
};

// Least squares of y = intercept + slope x over the trials.
Line FitLine(const double (&x)[kWlrTrials], const double (&y)[kWlrTrials]) {
    constexpr double kGuard = 1e-4;  // on the determinant
    double sx = 0, sxx = 0, sy = 0, sxy = 0;
    for (int t = 0; t < kWlrTrials; ++t) {
        sx += x[t];
        sxx += x[t] * x[t];
        sy += y[t];
        sxy += x[t] * y[t];
    }
    const double inverse = 1 / (kWlrTrials * sxx - sx * sx + kGuard);
    return {(sxx * sy - sx * sxy) * inverse, (kWlrTrials * sxy - sx * sy) * inverse};
}

// h^-power by products: the same on every system.
double InversePower(double h, int power) {
    double result = 1;
    for (int k = 0; k < power; ++k) {
        result /= h;
    }
    return result;
}

}  // namespace

double WlrCurves::Variance(double h) const {
    return std::max(0.0, floor + spread * InversePower(h, dimensions)) / count;
}

double WlrCurves::BestBandwidth() const {
    if (!(spread > 0)) {
        return kLeast;
    }
    if (bias == 0) {
        return kLargest;
    }
    const double h =
        std::pow(dimensions * spread / (4 * bias * bias * count), 1.0 / (dimensions + 4));
    return std::clamp(h, kLeast, kLargest);
}

WlrCurves FitCurves(const WlrTrials& trials) {
    double squared[kWlrTrials], inverse[kWlrTrials], variance[kWlrTrials];
    for (int t = 0; t < kWlrTrials; ++t) {
        const double h = TrialBandwidth(t);
        squared[t] = h * h;
        inverse[t] = InversePower(h, trials.dimensions);
        variance[t] = trials.count * trials.variance[t];
    }
    const Line change = FitLine(squared, trials.change);
    Line spread = FitLine(inverse, variance);
    if (spread.slope < 0) {
        spread = {0, -spread.slope};
    }
    return {change.intercept, change.slope,      spread.intercept,
            spread.slope,     trials.dimensions, trials.count};
}

}  // namespace relume::denoise
