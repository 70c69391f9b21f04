#define RELUME_LANES 8
#include "server/denoise/regression_kernels_impl.h"

namespace relume::denoise {

const RegressionKernels kRegressionAvx2Kernels = {"avx2", Regress, Sharpen};

}  // namespace relume::denoise
