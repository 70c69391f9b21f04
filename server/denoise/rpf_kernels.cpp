#include "server/denoise/rpf_kernels.h"

namespace relume::denoise {

RpfList UsableRpfs() {
    RpfList usable = {{&kRpfBaseline, nullptr, nullptr}, 1};
#if RELUME_WIDE_KERNELS
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("popcnt")) {
        usable.list[usable.size++] = &kRpfAvx2;
    }
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
        __builtin_cpu_supports("avx512vpopcntdq")) {
        usable.list[usable.size++] = &kRpfAvx512;
    }
#endif
    return usable;
}

const RpfKernels& BestRpf() {
    static const RpfList usable = UsableRpfs();
    return *usable.list[usable.size - 1];
}

}  // namespace relume::denoise
