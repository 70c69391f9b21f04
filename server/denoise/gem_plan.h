#pragma once

#include "server/denoise/gem_scales.h"

namespace relume::denoise {

// Where GEM puts `samples` more: the worst pixels by the error relative to the squared mean times
// what a batch of samples is expected to take off it, and each one's batch spread by the Gaussian
// that it was given, within the image. Expected counts, row-major, `samples` in all. `scales` is
// what the selection was made with.
Plane PlanGemSamples(const GemSelection& selection, const GemScales& scales, int width, int height,
                     double samples);

}  // namespace relume::denoise
