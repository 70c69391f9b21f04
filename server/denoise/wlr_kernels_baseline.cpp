#define RELUME_LANES 4
#include "server/denoise/wlr_kernels_impl.h"

namespace relume::denoise {

const WlrKernels kWlrBaselineKernels = {"baseline", TryBandwidths, FitPixels};

}  // namespace relume::denoise
