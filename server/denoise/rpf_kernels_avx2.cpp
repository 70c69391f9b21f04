#define RELUME_LANES 8
#include "server/denoise/rpf_kernels_impl.h"

namespace relume::denoise {

const RpfKernels kRpfAvx2 = {Alike, Sum, SumSquares, Normalise, MakeMasks, CountBoth, Weigh};

}  // namespace relume::denoise
