// relume-network-runner WEIGHTS.tza WIDTH HEIGHT LAYER...: runs a network on planes of float32 from
// standard input, writes its output planes to standard output. A LAYER is "conv:NAME:INPUT",
// "relu:NAME:INPUT" (a convolution with ReLU), "pool:NAME:INPUT", "up:NAME:INPUT",
// "concat:NAME:INPUT:INPUT..."; or "oidn", "oidn-large": a whole graph. For
// python/network_test.py.
#include <cstdio>
#include <exception>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "server/denoise/network/network.h"
#include "server/denoise/oidn_networks.h"

namespace relume::denoise {
namespace {

std::vector<std::string> Split(const std::string& text) {
    std::vector<std::string> words(1);
    for (const char c : text) {
        if (c == ':') {
            words.emplace_back();
        } else {
            words.back() += c;
        }
    }
    return words;
}

GraphSpec Read(const std::vector<std::string>& layers) {
    if (layers == std::vector<std::string>{"oidn"}) {
        return OidnGraph();
    }
    if (layers == std::vector<std::string>{"oidn-large"}) {
        return OidnLargeGraph();
    }
    GraphSpec graph;
    for (const std::string& layer : layers) {
        const auto words = Split(layer);
        if (words.size() < 3) {
            ThrowInvalidArgument("a layer is KIND:NAME:INPUT, not " + layer);
        }
        if (words[0] == "conv" || words[0] == "relu") {
            graph.layers.push_back(Convolution(words[1], words[2], words[0] == "relu"));
        } else if (words[0] == "pool") {
            graph.layers.push_back(Pool(words[1], words[2]));
        } else if (words[0] == "up") {
            graph.layers.push_back(Upsample(words[1], words[2]));
        } else if (words[0] == "concat") {
            graph.layers.push_back(Concatenate(words[1], {words.begin() + 2, words.end()}));
        } else {
            ThrowInvalidArgument("no known layer: " + layer);
        }
    }
    return graph;
}

void Run(const std::vector<std::string>& arguments) {
    if (arguments.size() < 4) {
        ThrowInvalidArgument("usage: relume-network-runner WEIGHTS.tza WIDTH HEIGHT LAYER...");
    }
    const int width = std::stoi(arguments[1]), height = std::stoi(arguments[2]);
    const Network network(Read({arguments.begin() + 3, arguments.end()}), ReadTza(arguments[0]),
                          arguments[0]);
    std::vector<Plane> inputs(static_cast<std::size_t>(network.input_channels()),
                              Plane(static_cast<std::size_t>(width * height)));
    std::vector<const float*> pointers;
    for (Plane& plane : inputs) {
        if (std::fread(plane.data(), sizeof(float), plane.size(), stdin) != plane.size()) {
            ThrowInvalidArgument("standard input ends before its planes");
        }
        pointers.push_back(plane.data());
    }
    for (const Plane& plane : network.Run(pointers, width, height, CancelToken{})) {
        std::fwrite(plane.data(), sizeof(float), plane.size(), stdout);
    }
}

}  // namespace
}  // namespace relume::denoise

int main(int argc, char** argv) {
    try {
        relume::denoise::Run({argv + 1, argv + argc});
    } catch (const std::exception& error) {
        std::fprintf(stderr, "relume-network-runner: %s\n", error.what());
        return 1;
    }
    return 0;
}
