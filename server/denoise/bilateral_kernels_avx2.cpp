#define RELUME_LANES 8
#include "server/denoise/bilateral_kernels_impl.h"

namespace relume::denoise {

const BilateralKernels kAvx2Kernels = {"avx2", Bank, Guide, Robust, Printed};

}  // namespace relume::denoise
