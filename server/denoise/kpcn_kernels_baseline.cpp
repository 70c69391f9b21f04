#define RELUME_LANES 4
#include "server/denoise/kpcn_kernels_impl.h"

namespace relume::denoise {

const KpcnKernel kKpcnBaseline = Kpcn;

}  // namespace relume::denoise
