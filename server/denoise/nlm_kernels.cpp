#include "server/denoise/nlm_kernels.h"

namespace relume::denoise {

NlmKernelList UsableNlmKernels() {
    NlmKernelList usable = {{&kNlmBaselineKernels, nullptr, nullptr}, 1};
#if RELUME_WIDE_KERNELS
    if (__builtin_cpu_supports("avx2")) {
        usable.list[usable.size++] = &kNlmAvx2Kernels;
    }
    if (__builtin_cpu_supports("avx512f")) {
        usable.list[usable.size++] = &kNlmAvx512Kernels;
    }
#endif
    return usable;
}

const NlmKernels& BestNlmKernels() {
    static const NlmKernelList usable = UsableNlmKernels();
    return *usable.list[usable.size - 1];
}

}  // namespace relume::denoise
