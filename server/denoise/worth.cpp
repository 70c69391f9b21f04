#include "server/denoise/worth.h"

#include <algorithm>
#include <cmath>

namespace relume::denoise {
namespace {

// Error of what is filtered, with samples, to the power of minus that. The noise alone: 1, and more
// where an adaptive sampler has few pixels left to work on, which the filtered error follows. Less
// is a sign of samples that are found late, of which the estimate knows nothing yet.
constexpr double kFalls = 0.8;
constexpr double kMostFalls = 3;
// 0.53 us a ray on one core, the geometric mean of seven generated scenes (train/scenes.py).
constexpr double kRayCost = 0.36;
constexpr double kUsualRays = 4.8;
constexpr double kUsualMixCost = 0.2;
constexpr double kMixPixels = 2e4;  // of the bilateral filter take as long as the networks' set-up
// What the network makes of oidn's image and the bilateral filter's, over the latter: the better
// that one, the more. Where noise is easily removed, it removes more of it; where little is left to
// remove, it can't. On 36 generated scenes at 8 and 32 samples a pixel (train/scenes.py, seeds that
// were not trained on) the least squares line through 1 of the logarithms.
constexpr double kOidnPower = 0.35, kOidnTypical = 0.4;
constexpr double kLeastLeft = 0.02;  // to which the line is followed

double OidnGain(double left) {
    // At 1 and beyond the bilateral filter has failed.
    return left > 0 && left < 1 ? std::pow(std::max(left, kLeastLeft), kOidnPower) : kOidnTypical;
}

}  // namespace

double MixCost(std::size_t pixels) {
    return kUsualMixCost + (pixels > 0 ? kMixPixels / static_cast<double>(pixels) : 0);
}

double SampleCost(const Sampling& sampling) {
    return kRayCost * (sampling.rays > 0 ? sampling.rays : kUsualRays);
}

double SamplesFor(double gain, const Sampling& sampling) {
    return std::pow(gain, -1 / (kFalls * std::clamp(sampling.falls, 1.0, kMostFalls))) - 1;
}

std::array<Gain, 3> ExpectedGains(bool has_oidn, double bilateral_over_none) {
    if (has_oidn) {
        return {{{kOidnSlot, OidnGain(bilateral_over_none)}, {kRdSlot, 0.93}, {kNforSlot, 0.96}}};
    }
    return {{{kRdSlot, 0.82}, {kNforSlot, 0.88}, {kOidnSlot, 1}}};
}

}  // namespace relume::denoise
