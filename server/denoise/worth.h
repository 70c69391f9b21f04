#pragma once

#include <array>
#include <cstddef>

#include "server/denoise/net_inputs.h"
#include "server/denoise/sampling.h"

namespace relume::denoise {

// What filters cost, and what they are worth: how many samples their gain would have needed.
//
// Costs are in times of the bilateral filter on the same pixels (bench/filters): 0.73 s a megapixel
// on two cores.
inline constexpr std::array<double, kNetSlotCount> kFilterCost = {0, 1, 2.4, 4, 0.65};
inline constexpr double kPrefilterCost = 1.1;  // of oidn's features
// Of the network that mixes, of an image of so many pixels: small ones take longer.
double MixCost(std::size_t pixels);
// Of a sample a pixel.
double SampleCost(const Sampling& sampling);

// Samples over those that are there that would lower the error to `gain` of it as well.
double SamplesFor(double gain, const Sampling& sampling);

// The candidates of `net` beside the noisy image and the bilateral filter, in the order in which
// they are worth their time, and what is expected of each: its error over that without it.
// `bilateral_over_none`: what the bilateral filter leaves of the error of the noisy image, as far
// as is known; else 0.
struct Gain {
    std::size_t slot;
    double gain;
};
std::array<Gain, 3> ExpectedGains(bool has_oidn, double bilateral_over_none);
// Of prefiltered features for oidn, in what the network mixes.
inline constexpr double kPrefilterGain = 0.97;

}  // namespace relume::denoise
