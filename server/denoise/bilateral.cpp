// Cross-bilateral filter of Xing, Chen, Li 2020 (equations 7 to 15; methods 3.3 to 3.7, 3.9).
//
//   mode    printed or corrected (default)
//   taylor  printed only: terms of (15) after the first, 0 to 64; 0 = (14) by exp directly (default
//   8)
//
// A pixel becomes the weighted mean of its window; weights fall with distance, and with the
// difference of normal, albedo and depth (over the frame's largest) in units of their noise.
// Features that the frame lacks are left out.
//
// corrected: seven windows, sigma_s = 1, sqrt(2), ..., 8 pixels (radius 2 sigma_s, at most 16),
// with the constants of SBF (Li, Wu, Chuang 2012): sigma .8 normal, .25 albedo, .6 depth, squared
// distances, floor 1e-2 on a pair's variance of one sample. No range term. Each pixel takes the
// window with the least SURE, smoothed by sigma = 4 pixels. The seven share the feature weights,
// which are computed once a pair of pixels. The estimated error is the chosen window's smoothed
// SURE.
//
// printed: the equations literally: the spatial kernel is replaced by the slope of the noisy
// image's Sobel gradient times a Gaussian of its difference (13, 14), which favours unlike
// neighbours and is 0 on flat ground; D of (8) is used without a square; sigma .4, .125, .3 for
// features, 8 in linear radiance for the range term. What the paper leaves open: radius 8; own
// weight 1; a pixel without like neighbours stays; one sigma_s for the frame, raised through the
// list while the error estimated from the halves falls. Needs the halves.
//
// Limits: shadow edges that no feature shows are softened; the error has a floor that more samples
// don't lower.
#include "server/denoise/bilateral.h"

#include <fmt/format.h>

#include "core/base/error.h"

namespace relume::denoise {

std::unique_ptr<Denoiser> MakeBilateral(const ParamSet& params) {
    const std::string mode =
        params.GetChoice("mode", "corrected", {"robust", "corrected", "printed"});
    if (mode == "robust") {
        return MakeRobustBilateral(BestKernels());
    }
    if (mode == "corrected") {
        return MakeCorrectedBilateral(BestKernels());
    }
    const int taylor = params.GetInt("taylor", 8);
    if (taylor < 0 || taylor > 64) {
        ThrowInvalidArgument(fmt::format("filter 'bilateral': taylor={} must be 0 to 64", taylor));
    }
    return MakePrintedBilateral(taylor, BestKernels());
}

}  // namespace relume::denoise
