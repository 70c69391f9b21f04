#include "server/denoise/kpcn_kernels.h"

namespace relume::denoise {

KpcnList UsableKpcn() {
    KpcnList usable = {{kKpcnBaseline, nullptr, nullptr}, 1};
#if RELUME_WIDE_KERNELS
    if (__builtin_cpu_supports("avx2")) {
        usable.list[usable.size++] = kKpcnAvx2;
    }
    if (__builtin_cpu_supports("avx512f")) {
        usable.list[usable.size++] = kKpcnAvx512;
    }
#endif
    return usable;
}

KpcnKernel BestKpcn() {
    static const KpcnList usable = UsableKpcn();
    return usable.list[usable.size - 1];
}

}  // namespace relume::denoise
