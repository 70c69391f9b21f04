#define RELUME_LANES 8
#include "server/denoise/network/winograd_kernels_impl.h"

namespace relume::denoise {

const WinogradKernels kWinogradAvx2 = kWinograd;

}  // namespace relume::denoise
