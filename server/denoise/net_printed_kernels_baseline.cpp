#define RELUME_LANES 4
#include "server/denoise/net_printed_kernels_impl.h"

namespace relume::denoise {

const NetPrintedKernel kNetPrintedBaseline = NetPrinted;

}  // namespace relume::denoise
