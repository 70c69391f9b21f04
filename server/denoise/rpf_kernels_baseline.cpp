#define RELUME_LANES 4
#include "server/denoise/rpf_kernels_impl.h"

namespace relume::denoise {

const RpfKernels kRpfBaseline = {Alike, Sum, SumSquares, Normalise, MakeMasks, CountBoth, Weigh};

}  // namespace relume::denoise
