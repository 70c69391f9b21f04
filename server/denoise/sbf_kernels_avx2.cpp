#define RELUME_LANES 8
#include "server/denoise/sbf_kernels_impl.h"

namespace relume::denoise {

const SbfKernels kSbfAvx2Kernels = {"avx2", SbfBank, SbfSmooth};

}  // namespace relume::denoise
