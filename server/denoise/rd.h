#pragma once

#include <memory>

#include "server/denoise/denoiser.h"
#include "server/denoise/nlm_kernels.h"

namespace relume::denoise {

// The filter of rd.cpp; the kernels may be any that this processor has, and the frame may be
// filtered in bands of any size (pixels, about; each has some 30 rows of its neighbours with it,
// and takes 200 bytes a pixel): the bits are the same.
std::unique_ptr<Denoiser> MakeRd(const NlmKernels& kernels, std::size_t band_pixels = 1 << 22);

}  // namespace relume::denoise
