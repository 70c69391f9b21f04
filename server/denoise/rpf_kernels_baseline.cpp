#define RELUME_LANES 4
#include "server/denoise/rpf_kernels_impl.h"

namespace relume::denoise {

const RpfKernel kRpfBaseline = Weigh;

}  // namespace relume::denoise
