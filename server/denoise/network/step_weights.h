#pragma once

#include <optional>
#include <vector>

#include "server/denoise/network/convolution.h"
#include "server/denoise/network/graph.h"
#include "server/denoise/network/winograd.h"

namespace relume::denoise {

// A step's weights as they are run: by Winograd's way if the kernel is 3x3 and the processor has
// the instructions, else by oneDNN, filled up with zeros to whole groups of channels. Without
// kernel: neither.
struct StepWeights {
    std::optional<WinogradWeights> winograd;
    std::optional<ConvolutionWeights> convolution;
};

// By step. The graph's own are gone then: nobody else needs them.
std::vector<StepWeights> PrepareWeights(Graph* graph);

// Groups of ChannelLanes() that a tensor's channels fill.
int GroupsOf(const Graph& graph, int tensor);

// Channels of a step's sources, each filled up to groups of its own, and of its result.
int FilledInputs(const Graph& graph, const GraphStep& step);
int FilledOutputs(const GraphStep& step);

}  // namespace relume::denoise
