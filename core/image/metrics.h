#pragma once

#include <cstdint>
#include <vector>

#include "core/image/image.h"

namespace relume {

inline constexpr double kMrSEEpsilon = 0.001;   // the seed paper's MrSE
inline constexpr double kRelMSEEpsilon = 0.01;  // RelMSE

// How far `test` is from `reference`, on the RGB of both. Lower is better but for SSIM and PSNR.
struct ImageError {
    double mrse = 0;          // mean over pixels and channels of (test-ref)^2 / (ref^2 + 0.001)
    double mrse_trimmed = 0;  // the same without the 0.1 % of pixels that have the largest error
    double relmse = 0;        // as mrse with 0.01
    double ssim = 0;          // Wang et al. 2004 on the luma of the clamped, sRGB-encoded images
    double psnr = 0;          // dB, on the clamped sRGB-encoded RGB, peak 1
    double flip = 0;          // mean LDR-FLIP (Andersson et al. 2020) at 67 pixels per degree
    double energy = 0;        // mean(test) / mean(reference)
    // Pixels with a NaN or infinity, scored as black; one that is bad in both images counts twice.
    std::int64_t bad = 0;
    std::int64_t negative = 0;  // pixels of `test` with a channel below 0
};

// Compares channels layer.R, layer.G, layer.B ("" for R, G, B) of the data windows. Throws
// kInvalidArgument if sizes differ or channels lack. SSIM needs 11x11 pixels, and is NaN below.
ImageError CompareImages(const Image& reference, const Image& test,
                         const std::string& reference_layer = "",
                         const std::string& test_layer = "", bool with_flip = true);

}  // namespace relume
