#define RELUME_LANES 8
#include "server/denoise/rpf_kernels_impl.h"

namespace relume::denoise {

const RpfKernel kRpfAvx2 = Weigh;

}  // namespace relume::denoise
