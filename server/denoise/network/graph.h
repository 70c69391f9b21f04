#pragma once

#include <string>
#include <vector>

#include "server/denoise/network/network.h"
#include "server/denoise/network/tza.h"

namespace relume::denoise {

// A tensor of pixels, `channels` numbers each, at the input's size divided by 2^scale.
struct GraphTensor {
    int channels, scale;
    int last_step = -1;  // that reads it
};

// Channels of a tensor, each pixel standing for 2^up x 2^up.
struct GraphSource {
    int tensor, up;
};

// What is computed in one sweep over the pixels: sources side by side, convolved or not, pooled or
// not. Upsampling and concatenation are how sources are read, and what is pooled is never stored at
// full size unless something else reads it.
struct GraphStep {
    std::vector<GraphSource> sources;  // without convolution: one
    int inputs = 0;                    // channels of the sources in all
    int scale = 0;                     // before pooling
    int kernel = 0;                    // 0: no convolution
    bool relu = false, pool = false;
    std::vector<float> weights, bias;  // outputs x inputs x kernel x kernel; outputs
    int outputs = 0;                   // channels
    int tensor = -1;                   // that it writes; -1: the network's output
};

struct Graph {
    std::vector<GraphTensor> tensors;  // 0: the network's input
    std::vector<GraphStep> steps;
    int alignment = 1, halo = 0;  // network.h
};

// Throws kInvalidArgument if the weights don't fit, or the graph makes no sense.
Graph LowerGraph(const GraphSpec& spec, const TensorArchive& weights, const std::string& source);

}  // namespace relume::denoise
