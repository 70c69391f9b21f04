#define RELUME_LANES 16
#include "server/denoise/wlr_kernels_impl.h"

namespace relume::denoise {

const WlrKernels kWlrAvx512Kernels = {"avx512", TryBandwidths, FitPixels};

}  // namespace relume::denoise
