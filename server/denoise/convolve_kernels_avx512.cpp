#define RELUME_LANES 16
#include "server/denoise/convolve_kernels_impl.h"

namespace relume::denoise {

const ConvolveKernel kConvolveAvx512 = Convolve;

}  // namespace relume::denoise
