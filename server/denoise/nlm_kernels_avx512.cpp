#define RELUME_LANES 16
#include "server/denoise/nlm_kernels_impl.h"

namespace relume::denoise {

const NlmKernels kNlmAvx512Kernels = {"avx512", Pair,      Between, Nudge,     Box,
                                      Weights,  Symmetric, Cut,     Accumulate};

}  // namespace relume::denoise
