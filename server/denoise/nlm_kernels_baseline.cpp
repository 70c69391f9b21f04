#define RELUME_LANES 4
#include "server/denoise/nlm_kernels_impl.h"

namespace relume::denoise {

const NlmKernels kNlmBaselineKernels = {"baseline", Pair,      Between, Nudge,     Box,
                                        Weights,    Symmetric, Cut,     Accumulate};

}  // namespace relume::denoise
