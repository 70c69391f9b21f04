#include "server/denoise/network/winograd.h"

#include <algorithm>
#include <array>

namespace relume::denoise {
namespace {

// Of the polynomials through 0, 1, -1, 2, -2 and infinity.
constexpr double kWeights[6][3] = {{1.0 / 4, 0, 0},
                                   {-1.0 / 6, -1.0 / 6, -1.0 / 6},
                                   {-1.0 / 6, 1.0 / 6, -1.0 / 6},
                                   {1.0 / 24, 1.0 / 12, 1.0 / 6},
                                   {1.0 / 24, -1.0 / 12, 1.0 / 6},
                                   {0, 0, 1}};

std::array<float, 36> Transform(const float* kernel) {
    std::array<float, 36> to;
    for (int y = 0; y < 6; ++y) {
        for (int x = 0; x < 6; ++x) {
            double sum = 0;
            for (int v = 0; v < 3; ++v) {
                for (int u = 0; u < 3; ++u) {
                    sum += kWeights[y][v] * kWeights[x][u] * static_cast<double>(kernel[3 * v + u]);
                }
            }
            to[static_cast<std::size_t>(6 * y + x)] = static_cast<float>(sum);
        }
    }
    return to;
}

}  // namespace

WinogradWeights::WinogradWeights(const WinogradKernels& kernels, const std::vector<float>& weights,
                                 const std::vector<float>& bias, int inputs)
    : kernels_(&kernels), inputs_(inputs) {
    const int lanes = kernels.lanes, real = static_cast<int>(bias.size());
    const int vectors = (real + lanes - 1) / lanes;
    outputs_ = vectors * lanes;
    const int count = (vectors + kernels.most_vectors - 1) / kernels.most_vectors;
    for (int panel = 0, first = 0; panel < count; ++panel) {
        const int next = (panel + 1) * vectors / count;
        panels_.push_back({first * lanes, next - first});
        first = next;
    }
    const std::size_t size = static_cast<std::size_t>(inputs) * static_cast<std::size_t>(outputs_);
    matrices_ = AllocateBuffer(36 * size);
    std::fill_n(matrices_.get(), 36 * size, 0.0f);
    for (const Panel& panel : panels_) {
        const int width = panel.vectors * lanes;
        for (int o = panel.first; o < std::min(panel.first + width, real); ++o) {
            for (int k = 0; k < inputs; ++k) {
                const auto values =
                    Transform(weights.data() + (static_cast<std::ptrdiff_t>(o) * inputs + k) * 9);
                float* to = matrices_.get() + static_cast<std::ptrdiff_t>(panel.first) * inputs +
                            static_cast<std::ptrdiff_t>(k) * width + (o - panel.first);
                for (const float value : values) {
                    *to = value;
                    to += size;
                }
            }
        }
    }
    bias_ = AllocateBuffer(static_cast<std::size_t>(outputs_));
    std::fill(std::copy(bias.begin(), bias.end(), bias_.get()), bias_.get() + outputs_, 0.0f);
}

void WinogradWeights::Multiply(const float* tiles, std::ptrdiff_t step, std::ptrdiff_t pitch,
                               int count, float* to, std::ptrdiff_t to_step) const {
    const float* matrix = matrices_.get();
    for (int i = 0; i < 36; ++i, tiles += step, to += to_step) {
        for (const Panel& panel : panels_) {
            kernels_->multiply(tiles, pitch, count, matrix, inputs_, panel.vectors,
                               to + panel.first, outputs_);
            matrix += static_cast<std::ptrdiff_t>(inputs_) * panel.vectors * kernels_->lanes;
        }
    }
}

}  // namespace relume::denoise
