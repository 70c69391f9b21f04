#pragma once

#include <memory>

#include "server/denoise/bilateral_kernels.h"
#include "server/denoise/denoiser.h"

namespace relume::denoise {

// The three modes of the bilateral filter; bilateral.cpp reads the parameters and says what they
// are. The kernels may be any that this processor has: the bits are the same.
std::unique_ptr<Denoiser> MakeCorrectedBilateral(const BilateralKernels& kernels);
std::unique_ptr<Denoiser> MakeRobustBilateral(const BilateralKernels& kernels);
std::unique_ptr<Denoiser> MakePrintedBilateral(int taylor, const BilateralKernels& kernels);

// Magnitude of the Sobel gradient of the grey image, replicated at the border: equations (10),
// (11).
Plane SobelMagnitude(const Frame& frame);

}  // namespace relume::denoise
