#pragma once

#include <memory>

#include "core/base/param_set.h"
#include "server/denoise/denoiser.h"
#include "server/denoise/rpf_kernels.h"

namespace relume::denoise {

// The filter, its inner loops by kernels of one's choice.
std::unique_ptr<Denoiser> MakeRpf(const ParamSet& params, const RpfKernels& kernels);

}  // namespace relume::denoise
