#pragma once

#include <array>
#include <cstdint>

#include "core/math/vec.h"

namespace relume::jobs {

// The selector of Xing, Chen, Li 2020, equations (4) to (6), for one pixel, as functions of numbers
// (methods 3.1).

inline constexpr std::array<double, 4> kPhi{5e-3, 1e-2, 2e-2, 5e-2};

// A pixel's value after a number of samples.
struct PixelEstimate {
    Rgb mean;
    Rgb variance;  // of the mean
    float n = 0;   // finite samples
};

// k = (s_c^2 + s_f^2) / (s_f^2 - s_c^2), the spp pair's factor of (4); s_c < s_f.
double SppFactor(double s_c, double s_f);

// Equation (5) as printed: k + Var[c] - Var[f], the variance averaged over RGB.
double PrintedGain(const PixelEstimate& c, const PixelEstimate& f);

// Equation (5) with the factor (c-f)^2 of (4) and the pixel's brightness put back, per channel and
// averaged: [k (c-f)^2 + Var[c] - Var[f]] / (f^2 + 1e-3).
double CorrectedGain(const PixelEstimate& c, const PixelEstimate& f);

// Equation (6) as printed: (0, Phi1], (Phi1, Phi2], (Phi2, Phi3], else; nothing for D <= 0. Phi4 is
// unused.
std::uint32_t PrintedIncrement(double d, const std::array<std::uint32_t, 4>& alpha);

// Equation (6) with all four thresholds: nothing up to Phi1, alpha4 above Phi4.
std::uint32_t CorrectedIncrement(double d, const std::array<std::uint32_t, 4>& alpha);

}  // namespace relume::jobs
