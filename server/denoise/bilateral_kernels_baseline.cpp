#define RELUME_LANES 4
#include "server/denoise/bilateral_kernels_impl.h"

namespace relume::denoise {

const BilateralKernels kBaselineKernels = {"baseline", Bank, Guide, Robust, Printed};

}  // namespace relume::denoise
