#define RELUME_LANES 4
#include "server/denoise/convolve_kernels_impl.h"

namespace relume::denoise {

const ConvolveKernel kConvolveBaseline = Convolve;

}  // namespace relume::denoise
