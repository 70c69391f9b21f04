#define RELUME_LANES 16
#include "server/denoise/net_printed_kernels_impl.h"

namespace relume::denoise {

const NetPrintedKernel kNetPrintedAvx512 = NetPrinted;

}  // namespace relume::denoise
