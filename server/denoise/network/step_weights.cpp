#include "server/denoise/network/step_weights.h"

#include <algorithm>
#include <utility>

namespace relume::denoise {
namespace {

int RoundUp(int value, int to) { return (value + to - 1) / to * to; }

ConvolutionWeights FillUp(const Graph& graph, const GraphStep& step) {
    const int inputs = FilledInputs(graph, step), outputs = FilledOutputs(step);
    const auto area = static_cast<std::size_t>(step.kernel * step.kernel);
    std::vector<float> weights(static_cast<std::size_t>(inputs * outputs) * area);
    for (int o = 0; o < step.outputs; ++o) {
        int from = o * step.inputs, to = o * inputs;
        for (const GraphSource& source : step.sources) {
            const int channels = graph.tensors[static_cast<std::size_t>(source.tensor)].channels;
            std::copy_n(step.weights.begin() + static_cast<std::ptrdiff_t>(from * area),
                        static_cast<std::size_t>(channels) * area,
                        weights.begin() + static_cast<std::ptrdiff_t>(to * area));
            from += channels;
            to += RoundUp(channels, ChannelLanes());
        }
    }
    std::vector<float> bias = step.bias;
    bias.resize(static_cast<std::size_t>(outputs));
    return {std::move(weights), std::move(bias)};
}

}  // namespace

int GroupsOf(const Graph& graph, int tensor) {
    const int lanes = ChannelLanes();
    return (graph.tensors[static_cast<std::size_t>(tensor)].channels + lanes - 1) / lanes;
}

int FilledInputs(const Graph& graph, const GraphStep& step) {
    int inputs = 0;
    for (const GraphSource& source : step.sources) {
        inputs += GroupsOf(graph, source.tensor) * ChannelLanes();
    }
    return inputs;
}

int FilledOutputs(const GraphStep& step) { return RoundUp(step.outputs, ChannelLanes()); }

std::vector<StepWeights> PrepareWeights(Graph* graph) {
    const WinogradKernels* kernels = FindWinogradKernels(VectorLanes());
    std::vector<StepWeights> weights(graph->steps.size());
    for (std::size_t s = 0; s < weights.size(); ++s) {
        GraphStep& step = graph->steps[s];
        if (step.kernel == 3 && kernels != nullptr) {
            weights[s].winograd.emplace(*kernels, step.weights, step.bias, step.inputs);
        } else if (step.kernel > 0) {
            weights[s].convolution = FillUp(*graph, step);
        }
        step.weights = {};
        step.bias = {};
    }
    return weights;
}

}  // namespace relume::denoise
