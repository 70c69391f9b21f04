#include "server/denoise/sbf_kernels.h"

namespace relume::denoise {

SbfKernelList UsableSbfKernels() {
    SbfKernelList usable = {{&kSbfBaselineKernels, nullptr, nullptr}, 1};
#if RELUME_WIDE_KERNELS
    if (__builtin_cpu_supports("avx2")) {
        usable.list[usable.size++] = &kSbfAvx2Kernels;
    }
    if (__builtin_cpu_supports("avx512f")) {
        usable.list[usable.size++] = &kSbfAvx512Kernels;
    }
#endif
    return usable;
}

const SbfKernels& BestSbfKernels() {
    static const SbfKernelList usable = UsableSbfKernels();
    return *usable.list[usable.size - 1];
}

}  // namespace relume::denoise
