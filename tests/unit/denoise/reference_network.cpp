#include "tests/unit/denoise/reference_network.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <random>

#include "tests/unit/denoise/synthetic.h"

namespace relume::denoise {
namespace {

struct Pixels {
    int channels = 0, width = 0, height = 0;
    std::vector<double> values;

    Pixels(int c, int w, int h)
        : channels(c), width(w), height(h), values(static_cast<std::size_t>(c * w * h)) {}

    double& At(int c, int x, int y) {
        return values[static_cast<std::size_t>((c * height + y) * width + x)];
    }
    double Or0(int c, int x, int y) const {
        return x < 0 || y < 0 || x >= width || y >= height
                   ? 0
                   : values[static_cast<std::size_t>((c * height + y) * width + x)];
    }
};

Pixels Convolve(const Pixels& in, const Tensor& weight, const Tensor& bias, bool relu) {
    const int outputs = weight.shape[0], kernel = weight.shape[2], side = kernel / 2;
    Pixels out(outputs, in.width, in.height);
    for (int o = 0; o < outputs; ++o) {
        for (int y = 0; y < in.height; ++y) {
            for (int x = 0; x < in.width; ++x) {
                double sum = bias.values[static_cast<std::size_t>(o)];
                const float* w =
                    &weight.values[static_cast<std::size_t>(o * in.channels * kernel * kernel)];
                for (int c = 0; c < in.channels; ++c) {
                    for (int dy = -side; dy <= side; ++dy) {
                        for (int dx = -side; dx <= side; ++dx) {
                            sum += *w++ * in.Or0(c, x + dx, y + dy);
                        }
                    }
                }
                out.At(o, x, y) = relu ? std::max(sum, 0.0) : sum;
            }
        }
    }
    return out;
}

Pixels PoolTwo(const Pixels& in) {
    Pixels out(in.channels, in.width / 2, in.height / 2);
    for (int c = 0; c < in.channels; ++c) {
        for (int y = 0; y < out.height; ++y) {
            for (int x = 0; x < out.width; ++x) {
                out.At(c, x, y) =
                    std::max({in.Or0(c, 2 * x, 2 * y), in.Or0(c, 2 * x + 1, 2 * y),
                              in.Or0(c, 2 * x, 2 * y + 1), in.Or0(c, 2 * x + 1, 2 * y + 1)});
            }
        }
    }
    return out;
}

Pixels UpsampleTwo(const Pixels& in) {
    Pixels out(in.channels, 2 * in.width, 2 * in.height);
    for (int c = 0; c < in.channels; ++c) {
        for (int y = 0; y < out.height; ++y) {
            for (int x = 0; x < out.width; ++x) {
                out.At(c, x, y) = in.Or0(c, x / 2, y / 2);
            }
        }
    }
    return out;
}

}  // namespace

std::vector<Plane> ReferenceNetwork(const GraphSpec& graph, const TensorArchive& weights,
                                    const std::vector<Plane>& inputs, int width, int height,
                                    int alignment) {
    const auto round_up = [=](int size) { return (size + alignment - 1) / alignment * alignment; };
    Pixels input(static_cast<int>(inputs.size()), round_up(width), round_up(height));
    for (int c = 0; c < input.channels; ++c) {
        for (int y = 0; y < height; ++y) {
            for (int x = 0; x < width; ++x) {
                input.At(c, x, y) =
                    inputs[static_cast<std::size_t>(c)][static_cast<std::size_t>(y * width + x)];
            }
        }
    }
    std::map<std::string, Pixels> values = {{"input", input}};
    for (const LayerSpec& layer : graph.layers) {
        const Pixels& in = values.at(layer.inputs.front());
        switch (layer.kind) {
            case LayerKind::kConvolution:
                values.emplace(layer.name, Convolve(in, weights.at(layer.name + ".weight"),
                                                    weights.at(layer.name + ".bias"), layer.relu));
                break;
            case LayerKind::kPool:
                values.emplace(layer.name, PoolTwo(in));
                break;
            case LayerKind::kUpsample:
                values.emplace(layer.name, UpsampleTwo(in));
                break;
            case LayerKind::kConcatenate: {
                Pixels all = in;
                for (std::size_t i = 1; i < layer.inputs.size(); ++i) {
                    const Pixels& more = values.at(layer.inputs[i]);
                    all.channels += more.channels;
                    all.values.insert(all.values.end(), more.values.begin(), more.values.end());
                }
                values.emplace(layer.name, std::move(all));
                break;
            }
        }
    }
    const Pixels& last = values.at(graph.layers.back().name);
    std::vector<Plane> outputs;
    for (int c = 0; c < last.channels; ++c) {
        Plane& plane = outputs.emplace_back();
        for (int y = 0; y < height; ++y) {
            for (int x = 0; x < width; ++x) {
                plane.push_back(static_cast<float>(last.Or0(c, x, y)));
            }
        }
    }
    return outputs;
}

void AddWeights(const char* name, int outputs, int inputs, int kernel, unsigned seed,
                TensorArchive* archive) {
    std::mt19937 rng(seed);
    Tensor weight = {{outputs, inputs, kernel, kernel}, {}};
    const int each = inputs * kernel * kernel;
    for (int i = 0; i < outputs * each; ++i) {
        weight.values.push_back(static_cast<float>(Normal(&rng) * std::sqrt(2.0 / each)));
    }
    Tensor bias = {{outputs}, {}};
    for (int o = 0; o < outputs; ++o) {
        bias.values.push_back(static_cast<float>(0.1 * Normal(&rng)));
    }
    (*archive)[std::string(name) + ".weight"] = std::move(weight);
    (*archive)[std::string(name) + ".bias"] = std::move(bias);
}

}  // namespace relume::denoise
