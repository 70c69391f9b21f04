#include "server/denoise/worth.h"

#include <algorithm>
#include <cmath>

namespace relume::denoise {
namespace {

constexpr double kFalls = 0.8;  // error, with time, to the power of minus that
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

double SamplesFor(double gain) { return std::pow(gain, -1 / kFalls) - 1; }

std::array<Gain, 3> ExpectedGains(bool has_oidn, double bilateral_over_none) {
    if (has_oidn) {
        return {{{kOidnSlot, OidnGain(bilateral_over_none)}, {kNforSlot, 0.9}, {kRdSlot, 0.99}}};
    }
    return {{{kNforSlot, 0.76}, {kRdSlot, 0.82}, {kOidnSlot, 1}}};
}

}  // namespace relume::denoise
