#define RELUME_LANES 16
#include "server/denoise/network/winograd_kernels_impl.h"

namespace relume::denoise {

const WinogradKernels kWinogradAvx512 = kWinograd;

}  // namespace relume::denoise
