#define RELUME_LANES 16
#include "server/denoise/rpf_kernels_impl.h"

namespace relume::denoise {

const RpfKernels kRpfAvx512 = {Alike, Sum, SumSquares, Normalise, MakeMasks, CountBoth, Weigh};

}  // namespace relume::denoise
