#define RELUME_LANES 8
#include "server/denoise/rd_kernels_impl.h"

namespace relume::denoise {

const RdKernels kRdAvx2Kernels = {"avx2", Features, Gather};

}  // namespace relume::denoise
