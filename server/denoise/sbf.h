#pragma once

#include <memory>

#include "server/denoise/denoiser.h"
#include "server/denoise/sbf_kernels.h"

namespace relume::denoise {

// SBF with or without the gradient feature (sbf.cpp says what they do). The kernels may be any that
// this processor has: the bits are the same.
std::unique_ptr<Denoiser> MakeSbf(bool gradient, const SbfKernels& kernels);

}  // namespace relume::denoise
