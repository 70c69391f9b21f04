// Cross-bilateral filter of Xing, Chen, Li 2020 (equations 7 to 15; methods 3.3 to 3.7, 3.9).
//
//   mode    robust (default), corrected or printed
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
// which are computed once a pair of pixels. Wide windows are thin: of what lies farther than 10.5
// pixels every other pixel counts for two, farther than 13.5 every fourth for four, farther than
// 16.5 none. The estimated error is the chosen window's smoothed SURE.
//
// robust: the seven, and the seven again with a range term (methods 3.7), which keeps what no
// feature shows: shadows, reflections. It doesn't compare noisy pixels, whose own noise would
// choose their neighbours, but a guide: the image filtered by the smallest window. Its factor is
// exp(-max(0, mean over RGB of (g^2 - v_i - min(v_i, v_j))/(2 kappa^2 (v_i + v_j) + 1e-10))), g the
// difference and v the variance of the guide, kappa^2 = 1.5. Each pixel takes the candidate F of
// least SURE, where squared errors are relative, over F^2 + 0.01 of the widest window, and smoothed
// as in corrected. The result is y + a (F - y), y the noisy pixel and a = sum of v (1 - dF/dy) /
// sum of (F - y)^2, 0 to 1, by the same weights over a Gaussian of 8 pixels: as samples grow, it
// tends to the noisy image.
//
// printed: the equations literally: the spatial kernel is replaced by the slope of the noisy
// image's Sobel gradient times a Gaussian of its difference (13, 14), which favours unlike
// neighbours and is 0 on flat ground; D of (8) is used without a square; sigma .4, .125, .3 for
// features, 8 in linear radiance for the range term. What the paper leaves open: radius 8; own
// weight 1; a pixel without like neighbours stays; one sigma_s for the frame, raised through the
// list while the error estimated from the halves falls. Needs the halves.
//
// Limits: corrected and printed soften shadow edges that no feature shows; their error has a floor
// that more samples don't lower. SURE is unbiased for Gaussian noise; where a few bright samples
// make the noise, the range term's candidates lose some of their energy, which SURE doesn't see:
// robust's estimated error is too low then.
#include "server/denoise/bilateral.h"
#include "server/denoise/seen_lights.h"

#include <fmt/format.h>

#include "core/base/error.h"

namespace relume::denoise {

std::unique_ptr<Denoiser> MakeBilateral(const ParamSet& params) {
    const std::string mode = params.GetChoice("mode", "robust", {"robust", "corrected", "printed"});
    if (mode == "robust") {
        return LightsApart(MakeRobustBilateral(BestKernels()));
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
