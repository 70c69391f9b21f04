#define RELUME_LANES 4
#include "server/denoise/regression_kernels_impl.h"

namespace relume::denoise {

const RegressionKernels kRegressionBaselineKernels = {"baseline", Regress, Sharpen};

}  // namespace relume::denoise
