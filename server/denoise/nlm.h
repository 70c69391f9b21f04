#pragma once

#include <memory>

#include "server/denoise/denoiser.h"
#include "server/denoise/nlm_kernels.h"

namespace relume::denoise {

// The filter of nlm.cpp; the kernels may be any that this processor has: the bits are the same.
std::unique_ptr<Denoiser> MakeNlm(const NlmKernels& kernels);

}  // namespace relume::denoise
