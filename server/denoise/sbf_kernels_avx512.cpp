#define RELUME_LANES 16
#include "server/denoise/sbf_kernels_impl.h"

namespace relume::denoise {

const SbfKernels kSbfAvx512Kernels = {"avx512", SbfBank, SbfSmooth};

}  // namespace relume::denoise
