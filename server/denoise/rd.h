#pragma once

#include <memory>

#include "server/denoise/denoiser.h"
#include "server/denoise/nlm_kernels.h"
#include "server/denoise/rd_frame.h"

namespace relume::denoise {

inline constexpr std::size_t kRdBandPixels = 1 << 22;

// The filter of rd.cpp; the kernels may be any that this processor has, and the frame may be
// filtered in bands of any size (pixels, about; each has RdReach(radius) rows of its neighbours
// with it, and takes 200 bytes a pixel): the bits are the same.
std::unique_ptr<Denoiser> MakeRd(const NlmKernels& kernels, std::size_t band_pixels = kRdBandPixels,
                                 int radius = kRdRadius);

}  // namespace relume::denoise
