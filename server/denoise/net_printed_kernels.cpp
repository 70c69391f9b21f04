#include "server/denoise/net_printed_kernels.h"

namespace relume::denoise {

NetPrintedList UsableNetPrinted() {
    NetPrintedList usable = {{kNetPrintedBaseline, nullptr, nullptr}, 1};
#if RELUME_WIDE_KERNELS
    if (__builtin_cpu_supports("avx2")) {
        usable.list[usable.size++] = kNetPrintedAvx2;
    }
    if (__builtin_cpu_supports("avx512f")) {
        usable.list[usable.size++] = kNetPrintedAvx512;
    }
#endif
    return usable;
}

NetPrintedKernel BestNetPrinted() {
    static const NetPrintedList usable = UsableNetPrinted();
    return usable.list[usable.size - 1];
}

}  // namespace relume::denoise
