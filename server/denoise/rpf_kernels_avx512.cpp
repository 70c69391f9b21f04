#define RELUME_LANES 16
#include "server/denoise/rpf_kernels_impl.h"

namespace relume::denoise {

const RpfKernel kRpfAvx512 = Weigh;

}  // namespace relume::denoise
