#include "server/denoise/network/winograd_kernels.h"

namespace relume::denoise {

const WinogradKernels* FindWinogradKernels([[maybe_unused]] int lanes) {
#if RELUME_WIDE_KERNELS
    if (lanes == kWinogradAvx512.lanes && __builtin_cpu_supports("avx512f")) {
        return &kWinogradAvx512;
    }
    if (lanes == kWinogradAvx2.lanes && __builtin_cpu_supports("avx2") &&
        __builtin_cpu_supports("fma")) {
        return &kWinogradAvx2;
    }
#endif
    return nullptr;
}

}  // namespace relume::denoise
