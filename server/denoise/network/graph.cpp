#include "server/denoise/network/graph.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "core/base/error.h"

namespace relume::denoise {
namespace {

constexpr int kLargestScale = 8;

// What a layer's name stands for.
struct Value {
    std::vector<GraphSource> sources;
    int scale = 0;
    int halo = 0;
};

class Lowering {
  public:
    Lowering(const GraphSpec& spec, const TensorArchive& weights, const std::string& source)
        : spec_(spec), weights_(weights), source_(source) {}

    Graph Run() {
        for (const LayerSpec& layer : spec_.layers) {
            for (const std::string& input : layer.inputs) {
                ++readers_[input];
            }
        }
        values_["input"] = {{{0, 0}}, 0, 0};
        graph_.tensors.push_back({0, 0});
        for (const LayerSpec& layer : spec_.layers) {
            layer_ = &layer;
            if ((layer.kind == LayerKind::kConcatenate) != (layer.inputs.size() > 1) ||
                layer.inputs.empty()) {
                Fail("has a wrong number of inputs");
            }
            if (&layer == &spec_.layers.front() &&
                (layer.kind != LayerKind::kConvolution || layer.inputs.front() != "input")) {
                Fail("is the first, and no convolution of the input");
            }
            const Value value = Lower(Find(layer.inputs.front()));
            if (!values_.emplace(layer.name, value).second) {
                Fail("is there twice");
            }
            graph_.alignment = std::max(graph_.alignment, 1 << value.scale);
            graph_.halo = value.halo;
        }
        Finish();
        return std::move(graph_);
    }

  private:
    [[noreturn]] void Fail(const std::string& what) const {
        ThrowInvalidArgument(
            fmt::format("{}: layer '{}' {}", source_, layer_ ? layer_->name : "input", what));
    }

    const Value& Find(const std::string& name) const {
        const auto value = values_.find(name);
        if (value == values_.end()) {
            Fail(fmt::format("reads '{}', which no layer before it is", name));
        }
        return value->second;
    }

    const Tensor& FindTensor(const std::string& name, std::size_t dimensions) const {
        const auto tensor = weights_.find(name);
        if (tensor == weights_.end()) {
            Fail(fmt::format("lacks its weights '{}'", name));
        }
        if (tensor->second.shape.size() != dimensions) {
            Fail(fmt::format("has weights '{}' of {} dimensions", name,
                             tensor->second.shape.size()));
        }
        return tensor->second;
    }

    int Channels(const std::vector<GraphSource>& sources) const {
        int channels = 0;
        for (const GraphSource& source : sources) {
            channels += graph_.tensors[static_cast<std::size_t>(source.tensor)].channels;
        }
        return channels;
    }

    Value Lower(Value value) {
        switch (layer_->kind) {
            case LayerKind::kConvolution:
                return Convolve(std::move(value));
            case LayerKind::kPool:
                return PoolTwo(std::move(value));
            case LayerKind::kUpsample:
                if (value.scale == 0) {
                    Fail("would be larger than the input");
                }
                for (GraphSource& source : value.sources) {
                    ++source.up;
                }
                --value.scale;
                // The other pixel of the pair, beyond what its coarser one depends on.
                value.halo += 1 << value.scale;
                return value;
            case LayerKind::kConcatenate:
                for (std::size_t i = 1; i < layer_->inputs.size(); ++i) {
                    const Value& other = Find(layer_->inputs[i]);
                    if (other.scale != value.scale) {
                        Fail(fmt::format("joins '{}' and '{}' of different sizes",
                                         layer_->inputs[0], layer_->inputs[i]));
                    }
                    value.sources.insert(value.sources.end(), other.sources.begin(),
                                         other.sources.end());
                    value.halo = std::max(value.halo, other.halo);
                }
                return value;
        }
        Fail("is of no known kind");
    }

    // Adds a step that reads `value`, and the tensor it writes.
    GraphStep& AddStep(const Value& value, int outputs) {
        GraphStep step;
        step.sources = value.sources;
        step.scale = value.scale;
        step.inputs = Channels(value.sources);
        step.outputs = outputs > 0 ? outputs : step.inputs;
        step.tensor = static_cast<int>(graph_.tensors.size());
        graph_.tensors.push_back({step.outputs, step.scale});
        graph_.steps.push_back(std::move(step));
        return graph_.steps.back();
    }

    Value Convolve(const Value& value) {
        const Tensor& weight = FindTensor(layer_->name + ".weight", 4);
        const Tensor& bias = FindTensor(layer_->name + ".bias", 1);
        const int outputs = weight.shape[0], inputs = weight.shape[1], kernel = weight.shape[2];
        if (kernel != weight.shape[3] || kernel % 2 == 0) {
            Fail(fmt::format("has a kernel of {}x{}, which is not square and odd", kernel,
                             weight.shape[3]));
        }
        if (bias.shape[0] != outputs) {
            Fail(fmt::format("has {} outputs and a bias of {}", outputs, bias.shape[0]));
        }
        if (graph_.steps.empty()) {
            graph_.tensors[0].channels = inputs;
        }
        GraphStep& step = AddStep(value, outputs);
        if (step.inputs != inputs) {
            Fail(fmt::format("has weights for {} channels and reads {}", inputs, step.inputs));
        }
        step.kernel = kernel;
        step.relu = layer_->relu;
        step.weights = weight.values;
        step.bias = bias.values;
        return {{{step.tensor, 0}}, value.scale, value.halo + (kernel / 2 << value.scale)};
    }

    Value PoolTwo(const Value& value) {
        if (value.scale == kLargestScale) {
            Fail("is the ninth pooling");
        }
        const int tensor = value.sources.front().tensor;
        const bool alone = value.sources.size() == 1 && value.sources.front().up == 0 &&
                           !graph_.steps.empty() && graph_.steps.back().tensor == tensor &&
                           !graph_.steps.back().pool && readers_[layer_->inputs.front()] == 1;
        if (alone) {
            graph_.steps.back().pool = true;
            ++graph_.tensors[static_cast<std::size_t>(tensor)].scale;
            return {{{tensor, 0}}, value.scale + 1, value.halo};
        }
        Value pooled = {{}, value.scale + 1, value.halo};
        for (const GraphSource& source : value.sources) {
            GraphStep& step = AddStep({{source}, value.scale, value.halo}, 0);
            step.pool = true;
            ++graph_.tensors[static_cast<std::size_t>(step.tensor)].scale;
            pooled.sources.push_back({step.tensor, 0});
        }
        return pooled;
    }

    void Finish() {
        if (spec_.layers.empty() || spec_.layers.back().kind != LayerKind::kConvolution ||
            graph_.steps.back().scale != 0) {
            Fail("is the last, and no convolution at the input's size");
        }
        graph_.steps.back().tensor = -1;
        graph_.tensors.pop_back();
        for (std::size_t s = 0; s < graph_.steps.size(); ++s) {
            const GraphStep& step = graph_.steps[s];
            for (const GraphSource& source : step.sources) {
                graph_.tensors[static_cast<std::size_t>(source.tensor)].last_step =
                    static_cast<int>(s);
            }
        }
    }

    const GraphSpec& spec_;
    const TensorArchive& weights_;
    const std::string& source_;
    const LayerSpec* layer_ = nullptr;
    std::map<std::string, Value> values_;
    std::map<std::string, int> readers_;
    Graph graph_;
};

}  // namespace

Graph LowerGraph(const GraphSpec& spec, const TensorArchive& weights, const std::string& source) {
    return Lowering(spec, weights, source).Run();
}

}  // namespace relume::denoise
