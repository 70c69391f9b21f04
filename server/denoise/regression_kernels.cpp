#include "server/denoise/regression_kernels.h"

namespace relume::denoise {

RegressionKernelList UsableRegressionKernels() {
    RegressionKernelList usable = {{&kRegressionBaselineKernels, nullptr, nullptr}, 1};
#if RELUME_WIDE_KERNELS
    if (__builtin_cpu_supports("avx2")) {
        usable.list[usable.size++] = &kRegressionAvx2Kernels;
    }
    if (__builtin_cpu_supports("avx512f")) {
        usable.list[usable.size++] = &kRegressionAvx512Kernels;
    }
#endif
    return usable;
}

const RegressionKernels& BestRegressionKernels() {
    static const RegressionKernelList usable = UsableRegressionKernels();
    return *usable.list[usable.size - 1];
}

}  // namespace relume::denoise
