#define RELUME_LANES 8
#include "server/denoise/net_printed_kernels_impl.h"

namespace relume::denoise {

const NetPrintedKernel kNetPrintedAvx2 = NetPrinted;

}  // namespace relume::denoise
