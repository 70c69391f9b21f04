#include "server/denoise/bilateral_kernels.h"

namespace relume::denoise {

KernelList UsableKernels() {
    KernelList usable = {{&kBaselineKernels, nullptr, nullptr}, 1};
#if RELUME_WIDE_KERNELS
    if (__builtin_cpu_supports("avx2")) {
        usable.list[usable.size++] = &kAvx2Kernels;
    }
    if (__builtin_cpu_supports("avx512f")) {
        usable.list[usable.size++] = &kAvx512Kernels;
    }
#endif
    return usable;
}

const BilateralKernels& BestKernels() {
    static const KernelList usable = UsableKernels();
    return *usable.list[usable.size - 1];
}

}  // namespace relume::denoise
