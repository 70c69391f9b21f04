#define RELUME_LANES 8
#include "server/denoise/nlm_kernels_impl.h"

namespace relume::denoise {

const NlmKernels kNlmAvx2Kernels = {"avx2",  Pair,      Between, Nudge,     Box,
                                    Weights, Symmetric, Cut,     Accumulate};

}  // namespace relume::denoise
