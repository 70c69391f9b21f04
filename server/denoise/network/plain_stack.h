#pragma once

#include <string>

#include "server/denoise/network/network.h"
#include "server/denoise/network/tza.h"

namespace relume::denoise {

// A network that is nothing but convolutions one after another, conv0, conv1, ..., as many as there
// are weights; ReLU but after the last.
inline GraphSpec PlainStack(const TensorArchive& weights) {
    const auto name = [](int i) { return "conv" + std::to_string(i); };
    int count = 0;
    while (weights.contains(name(count) + ".weight")) {
        ++count;
    }
    GraphSpec graph;
    for (int i = 0; i < count; ++i) {
        graph.layers.push_back(Convolution(name(i), i == 0 ? "input" : name(i - 1), i + 1 < count));
    }
    return graph;
}

}  // namespace relume::denoise
