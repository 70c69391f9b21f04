#include "server/denoise/wlr_kernels.h"

namespace relume::denoise {

WlrKernelList UsableWlrKernels() {
    WlrKernelList usable = {{&kWlrBaselineKernels, nullptr, nullptr}, 1};
#if RELUME_WIDE_KERNELS
    if (__builtin_cpu_supports("avx2")) {
        usable.list[usable.size++] = &kWlrAvx2Kernels;
    }
    if (__builtin_cpu_supports("avx512f")) {
        usable.list[usable.size++] = &kWlrAvx512Kernels;
    }
#endif
    return usable;
}

const WlrKernels& BestWlrKernels() {
    static const WlrKernelList usable = UsableWlrKernels();
    return *usable.list[usable.size - 1];
}

}  // namespace relume::denoise
