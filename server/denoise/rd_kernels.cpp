#include "server/denoise/rd_kernels.h"

namespace relume::denoise {

const RdKernels& RdKernelsFor([[maybe_unused]] const NlmKernels& kernels) {
#if RELUME_WIDE_KERNELS
    if (&kernels == &kNlmAvx512Kernels) {
        return kRdAvx512Kernels;
    }
    if (&kernels == &kNlmAvx2Kernels) {
        return kRdAvx2Kernels;
    }
#endif
    return kRdBaselineKernels;
}

}  // namespace relume::denoise
