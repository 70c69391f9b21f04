#pragma once

#include <vector>

#include "server/denoise/network/network.h"

namespace relume::denoise {

// The graph by its definition, in double precision, layer by layer: zeros beyond the border, and to
// the right and below up to `alignment`. Slow.
std::vector<Plane> ReferenceNetwork(const GraphSpec& graph, const TensorArchive& weights,
                                    const std::vector<Plane>& inputs, int width, int height,
                                    int alignment);

// Convolution weights NAME.weight and NAME.bias, random, such that the scale of what goes through
// is kept.
void AddWeights(const char* name, int outputs, int inputs, int kernel, unsigned seed,
                TensorArchive* archive);

}  // namespace relume::denoise
