#define RELUME_LANES 8
#include "server/denoise/convolve_kernels_impl.h"

namespace relume::denoise {

const ConvolveKernel kConvolveAvx2 = Convolve;

}  // namespace relume::denoise
