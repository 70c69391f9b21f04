#define RELUME_LANES 4
#include "server/denoise/rd_kernels_impl.h"

namespace relume::denoise {

const RdKernels kRdBaselineKernels = {"baseline", Features, Gather};

}  // namespace relume::denoise
