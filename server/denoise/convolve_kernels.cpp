#include "server/denoise/convolve_kernels.h"

namespace relume::denoise {

ConvolveList UsableConvolves() {
    ConvolveList usable = {{kConvolveBaseline, nullptr, nullptr}, 1};
#if RELUME_WIDE_KERNELS
    if (__builtin_cpu_supports("avx2")) {
        usable.list[usable.size++] = kConvolveAvx2;
    }
    if (__builtin_cpu_supports("avx512f")) {
        usable.list[usable.size++] = kConvolveAvx512;
    }
#endif
    return usable;
}

ConvolveKernel BestConvolve() {
    static const ConvolveList usable = UsableConvolves();
    return usable.list[usable.size - 1];
}

}  // namespace relume::denoise
