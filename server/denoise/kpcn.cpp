// Kernel-predicting network: Bako et al. 2017 (methods 2.9). A stack of 5x5 convolutions sees
// colour, normal, depth and albedo with their variances and differences, and tells for each pixel
// with what weights to average its neighbours' colours: 21x21 of them and nine layers of 100
// channels in the paper ("full"), 13x13 and five layers of 32 channels in the small form ("lite").
//
//   weights=NAME: NAME.tza in a folder of networks (network/weights.h): tensors conv1.weight,
//       conv1.bias, conv2.weight, ...; the last has as many outputs as the kernel has pixels, an
//       odd number squared, rows from the top. No weights are published, and none come with Relume.
//
// The film does not part diffuse from specular radiance, so that there is one network where the
// paper has two: it sees log(1 + x) of colours divided by albedo, and its kernels average these
// colours themselves. Where no surface is seen they are divided by 1.
//
// Limits: no estimate of its own error; a network's faults are its training's.
#include "server/denoise/kpcn.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/base/error.h"
#include "core/base/parallel.h"
#include "server/denoise/cancelled.h"
#include "server/denoise/kpcn_inputs.h"
#include "server/denoise/network/network.h"
#include "server/denoise/network/weights.h"

namespace relume::denoise {
namespace {

constexpr double kMostLogits = 32e6;  // at one time, of a tile: 128 MB

GraphSpec StackGraph(const TensorArchive& weights) {
    GraphSpec graph;
    std::string input = "input";
    for (int layer = 1; weights.contains(fmt::format("conv{}.weight", layer)); ++layer) {
        const std::string name = fmt::format("conv{}", layer);
        const bool last = !weights.contains(fmt::format("conv{}.weight", layer + 1));
        graph.layers.push_back(Convolution(name, input, !last));
        input = name;
    }
    return graph;
}

// Mirrored into [0, size), without the border pixel twice.
int Reflect(int at, int size) {
    if (size == 1) {
        return 0;
    }
    const int period = 2 * (size - 1);
    const int in_period = ((at % period) + period) % period;
    return std::min(in_period, period - in_period);
}

// The window's pixels; what lies beyond the image is mirrored.
Plane CutReflected(const Plane& plane, int image_width, int image_height, int x0, int y0, int width,
                   int height) {
    Plane out(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    for (int y = 0; y < height; ++y) {
        const int row = Reflect(y0 + y, image_height) * image_width;
        for (int x = 0; x < width; ++x) {
            out[static_cast<std::size_t>(y * width + x)] =
                plane[static_cast<std::size_t>(row + Reflect(x0 + x, image_width))];
        }
    }
    return out;
}

class Kpcn final : public Denoiser {
  public:
    Kpcn(const TensorArchive& weights, const std::string& name, int tile)
        : name_(name), network_(StackGraph(weights), weights, name) {
        const int outputs = network_.output_channels();
        side_ = static_cast<int>(std::lround(std::sqrt(outputs)));
        if (network_.input_channels() != kKpcnInputs || side_ * side_ != outputs ||
            side_ % 2 == 0) {
            ThrowInvalidArgument(
                fmt::format("{}: {} inputs and {} outputs; kpcn's network has {} inputs and as "
                            "many outputs as an odd square has pixels",
                            name, network_.input_channels(), outputs, kKpcnInputs));
        }
        const int fits = static_cast<int>(std::sqrt(kMostLogits / outputs));
        tile_ = tile > 0 ? tile : std::max(fits - 2 * network_.halo(), network_.halo());
    }

    std::string Describe() const override { return "kpcn:weights=" + name_; }

    Result Reconstruct(const Frame& frame, const CancelToken& cancel) const override {
        const KpcnInputs inputs = MakeKpcnInputs(frame);
        Result result;
        result.notes["kernel"] = fmt::format("{}x{}", side_, side_);
        for (Plane& plane : result.color) {
            plane.resize(frame.pixel_count());
        }
        for (int y = 0; y < frame.height; y += tile_) {
            for (int x = 0; x < frame.width; x += tile_) {
                FilterTile(frame, inputs, x, y, std::min(tile_, frame.width - x),
                           std::min(tile_, frame.height - y), &result, cancel);
            }
        }
        return result;
    }

  private:
    void FilterTile(const Frame& frame, const KpcnInputs& inputs, int x0, int y0, int width,
                    int height, Result* result, const CancelToken& cancel) const {
        // Logits: the network's own halo is mirrored, and cut off again.
        const int halo = network_.halo();
        const int wide = width + 2 * halo, high = height + 2 * halo;
        std::vector<Plane> seen;
        std::vector<const float*> pointers;
        for (const Plane& plane : inputs.planes) {
            seen.push_back(
                CutReflected(plane, frame.width, frame.height, x0 - halo, y0 - halo, wide, high));
        }
        for (const Plane& plane : seen) {
            pointers.push_back(plane.data());
        }
        const std::vector<Plane> logits = network_.Run(pointers, wide, high, cancel);

        // Colours in the kernels' reach.
        const int reach = side_ / 2;
        const int color_width = width + 2 * reach;
        Plane color[3];
        for (std::size_t c = 0; c < 3; ++c) {
            color[c] = CutReflected(inputs.color[c], frame.width, frame.height, x0 - reach,
                                    y0 - reach, color_width, height + 2 * reach);
        }
        ParallelFor(
            0, static_cast<std::size_t>(height), 1, [&](std::size_t begin, std::size_t end) {
                for (auto y = static_cast<int>(begin); y < static_cast<int>(end); ++y) {
                    ThrowIfCancelled(cancel);
                    const Plane row = FilterRow(logits, wide, color, color_width, y, width);
                    const auto to =
                        static_cast<std::size_t>(y0 + y) * static_cast<std::size_t>(frame.width) +
                        static_cast<std::size_t>(x0);
                    const auto w = static_cast<std::size_t>(width);
                    for (std::size_t c = 0; c < 3; ++c) {
                        for (std::size_t x = 0; x < w; ++x) {
                            result->color[c][to + x] = row[c * w + x] * inputs.albedo[c][to + x];
                        }
                    }
                }
            });
    }

    // A tile's row, the three channels one after another: the softmax of the logits as weights.
    Plane FilterRow(const std::vector<Plane>& logits, int logits_width, const Plane (&color)[3],
                    int color_width, int y, int width) const {
        const auto w = static_cast<std::size_t>(width);
        const int halo = network_.halo();
        const auto first = static_cast<std::size_t>((y + halo) * logits_width + halo);
        Plane largest(w, -INFINITY), sum(w), out(3 * w);
        for (const Plane& plane : logits) {
            for (std::size_t x = 0; x < w; ++x) {
                largest[x] = std::max(largest[x], plane[first + x]);
            }
        }
        for (int k = 0; k < side_ * side_; ++k) {
            const float* logit = logits[static_cast<std::size_t>(k)].data() + first;
            const auto from = static_cast<std::size_t>((y + k / side_) * color_width + k % side_);
            for (std::size_t x = 0; x < w; ++x) {
                const float weight = std::exp(logit[x] - largest[x]);
                sum[x] += weight;
                out[x] += weight * color[0][from + x];
                out[w + x] += weight * color[1][from + x];
                out[2 * w + x] += weight * color[2][from + x];
            }
        }
        for (std::size_t i = 0; i < out.size(); ++i) {
            out[i] /= sum[i % w];
        }
        return out;
    }

    std::string name_;
    Network network_;
    int side_ = 0;  // of a kernel, pixels
    int tile_ = 0;
};

}  // namespace

std::unique_ptr<Denoiser> MakeKpcn(const TensorArchive& weights, const std::string& name,
                                   int tile) {
    return std::make_unique<Kpcn>(weights, name, tile);
}

std::unique_ptr<Denoiser> MakeKpcn(const ParamSet& params) {
    const std::string name = params.GetString("weights", "");
    if (name.empty()) {
        ThrowInvalidArgument(
            "filter 'kpcn' needs weights=NAME, of NAME.tza in a folder of "
            "networks; none are published");
    }
    if (name.find('/') != std::string::npos) {
        ThrowInvalidArgument("filter 'kpcn': weights are named without folder and .tza");
    }
    const auto found = FindNetworkWeights(name);
    if (!found) {
        throw Error(ErrorCode::kFailedPrecondition,
                    fmt::format("filter 'kpcn': {}.tza is in none of {}; set RELUME_NETWORKS to "
                                "its folder",
                                name, NetworkFolders()));
    }
    return MakeKpcn(found->tensors, name, 0);
}

}  // namespace relume::denoise
