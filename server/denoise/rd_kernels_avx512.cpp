#define RELUME_LANES 16
#include "server/denoise/rd_kernels_impl.h"

namespace relume::denoise {

const RdKernels kRdAvx512Kernels = {"avx512", Features, Gather};

}  // namespace relume::denoise
