#define RELUME_LANES 16
#include "server/denoise/bilateral_kernels_impl.h"

namespace relume::denoise {

const BilateralKernels kAvx512Kernels = {"avx512", Bank, Guide, Robust, Printed};

}  // namespace relume::denoise
