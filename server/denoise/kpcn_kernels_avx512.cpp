#define RELUME_LANES 16
#include "server/denoise/kpcn_kernels_impl.h"

namespace relume::denoise {

const KpcnKernel kKpcnAvx512 = Kpcn;

}  // namespace relume::denoise
