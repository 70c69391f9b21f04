#define RELUME_LANES 4
#include "server/denoise/sbf_kernels_impl.h"

namespace relume::denoise {

const SbfKernels kSbfBaselineKernels = {"baseline", SbfBank, SbfSmooth};

}  // namespace relume::denoise
