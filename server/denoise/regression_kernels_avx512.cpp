#define RELUME_LANES 16
#include "server/denoise/regression_kernels_impl.h"

namespace relume::denoise {

const RegressionKernels kRegressionAvx512Kernels = {"avx512", Regress, Sharpen};

}  // namespace relume::denoise
