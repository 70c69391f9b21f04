#pragma once

#include <memory>

#include "server/denoise/denoiser.h"
#include "server/denoise/nlm_kernels.h"

namespace relume::denoise {

// The filter of rd.cpp; the kernels may be any that this processor has: the bits are the same.
std::unique_ptr<Denoiser> MakeRd(const NlmKernels& kernels);

}  // namespace relume::denoise
