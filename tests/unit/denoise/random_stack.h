#pragma once

#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "server/denoise/network/tza.h"

namespace relume::denoise {

// 0 to 1; torch_results.py draws the same.
class Numbers {
  public:
    explicit Numbers(std::uint32_t seed) : state_(seed) {}
    double Draw() {
        state_ = state_ * 1664525u + 1013904223u;
        return (state_ >> 8) * 0x1p-24;
    }

  private:
    std::uint32_t state_;
};

// Weights of convolutions conv0, conv1, ... between so many channels, kernels of side x side, that
// keep the scale of what goes through.
inline TensorArchive RandomStack(const std::vector<int>& channels, int side, std::uint32_t seed) {
    Numbers numbers(seed);
    TensorArchive archive;
    const auto fill = [&](const std::string& name, std::vector<int> shape, int fan_in) {
        std::size_t size = 1;
        for (const int n : shape) {
            size *= static_cast<std::size_t>(n);
        }
        Tensor& tensor = archive[name];
        tensor.shape = std::move(shape);
        for (std::size_t i = 0; i < size; ++i) {
            tensor.values.push_back(
                static_cast<float>((2 * numbers.Draw() - 1) * std::sqrt(6.0 / fan_in)));
        }
    };
    for (std::size_t i = 0; i + 1 < channels.size(); ++i) {
        const std::string name = "conv" + std::to_string(i);
        fill(name + ".weight", {channels[i + 1], channels[i], side, side},
             channels[i] * side * side);
        fill(name + ".bias", {channels[i + 1]}, 100);
    }
    return archive;
}

}  // namespace relume::denoise
