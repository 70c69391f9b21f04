#define RELUME_LANES 8
#include "server/denoise/kpcn_kernels_impl.h"

namespace relume::denoise {

const KpcnKernel kKpcnAvx2 = Kpcn;

}  // namespace relume::denoise
