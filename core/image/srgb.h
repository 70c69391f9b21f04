#pragma once

#include <algorithm>
#include <cmath>

namespace relume {

// sRGB transfer curve (IEC 61966-2-1) of a linear value clamped to [0,1].
inline double EncodeSrgb(double linear) {
    const double x = std::clamp(linear, 0.0, 1.0);
    return x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1 / 2.4) - 0.055;
}

}  // namespace relume
