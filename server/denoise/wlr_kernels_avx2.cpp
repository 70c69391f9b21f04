#define RELUME_LANES 8
#include "server/denoise/wlr_kernels_impl.h"

namespace relume::denoise {

const WlrKernels kWlrAvx2Kernels = {"avx2", TryBandwidths, FitPixels};

}  // namespace relume::denoise
