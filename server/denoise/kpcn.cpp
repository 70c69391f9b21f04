// Kernel-predicting network of Bako et al. 2017 (methods 2.9): convolutions see radiance, features
// and their noise, and say for each pixel the weights of its window.
//
//   size   lite: five 5x5 convolutions of 32 features, window 13x13 (default); full: the paper's
//          nine of 100, window 21x21, whose weights you have to train (train/kpcn.py)
//
// What is filtered is radiance over albedo, so that textures are left alone. The paper does so to
// diffuse light, and has a second network for specular light; the film does not part them: there is
// one network, and reflections are divided by the albedo too. The divisor is no less than 0.03, and
// about 1 where there is no surface (kpcn_inputs.h). The network sees logarithms of radiance;
// the weights, by softmax, are applied to radiance itself: a result lies between its window's
// pixels (over albedo). Convolutions see zeros beyond the border, kernels a mirrored image.
//
// The estimated error is SURE with the weights taken for fixed, although the network has seen the
// noise: too low where it follows it. No halves are needed.
#include "server/denoise/kpcn.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "core/base/parallel.h"
#include "core/base/param_set.h"
#include "server/denoise/cancelled.h"
#include "server/denoise/crop_frame.h"
#include "server/denoise/kpcn_inputs.h"
#include "server/denoise/network/network.h"
#include "server/denoise/network/plain_stack.h"
#include "server/denoise/network/weights.h"
#include "server/denoise/planes.h"

namespace relume::denoise {
namespace {

constexpr std::size_t kMostLogits = std::size_t{32} << 20;  // of a tile
constexpr float kSureBlur = 4;    // pixels: SURE of one pixel is mostly noise (methods 1.5)
constexpr std::size_t kRows = 4;  // a task

// Index of a pixel at `p` in a mirrored row: ... 2 1 0 1 2 ... n-2 n-1 n-2 ...
int Mirror(int p, int n) {
    const int period = std::max(2 * (n - 1), 1);
    const int q = (p % period + period) % period;
    return q < n ? q : period - q;
}

int RadiusOf(int outputs) {
    const int side = static_cast<int>(std::lround(std::sqrt(outputs)));
    return side % 2 == 1 && side * side == outputs ? side / 2 : -1;
}

class Kpcn final : public Denoiser {
  public:
    Kpcn(std::string size, std::shared_ptr<const Network> network)
        : size_(std::move(size)),
          network_(std::move(network)),
          radius_(RadiusOf(network_->output_channels())) {}

    std::string Describe() const override { return "kpcn:size=" + size_; }

    Result Reconstruct(const Frame& frame, const CancelToken& cancel) const override {
        Result result;
        Plane own(frame.pixel_count());
        for (Plane& plane : result.color) {
            plane.resize(frame.pixel_count());
        }
        // The outermost pixels of a tile lack the steps from their neighbours.
        const int halo = std::max(network_->halo() + 1, radius_);
        const std::size_t outputs = static_cast<std::size_t>(network_->output_channels());
        const int side = std::max(
            static_cast<int>(std::sqrt(static_cast<double>(kMostLogits / outputs))) - 2 * halo, 16);
        const float depth_scale = KpcnDepthScale(frame);
        for (int y = 0; y < frame.height; y += side) {
            for (int x = 0; x < frame.width; x += side) {
                const TileRect inner = {x, y, std::min(x + side, frame.width),
                                        std::min(y + side, frame.height)};
                FilterTile(frame, inner, halo, depth_scale, cancel,
                           {&result.color[0], &result.color[1], &result.color[2], &own});
            }
        }
        result.error = EstimateError(frame, result, own);
        result.notes["network"] =
            fmt::format("{}, kernels of {}x{} pixels", size_, 2 * radius_ + 1, 2 * radius_ + 1);
        return result;
    }

  private:
    void FilterTile(const Frame& frame, const TileRect& inner, int halo, float depth_scale,
                    const CancelToken& cancel, const std::array<Plane*, kKpcnOutputs>& out) const {
        ThrowIfCancelled(cancel);
        const TileRect area = {std::max(inner.x0 - halo, 0), std::max(inner.y0 - halo, 0),
                               std::min(inner.x1 + halo, frame.width),
                               std::min(inner.y1 + halo, frame.height)};
        const KpcnInputs inputs = MakeKpcnInputs(CropFrame(frame, area), depth_scale);
        std::vector<const float*> channels;
        for (const Plane& plane : inputs.channels) {
            channels.push_back(plane.data());
        }
        const std::vector<Plane> logits =
            network_->Run(channels, area.width(), area.height(), cancel);
        ApplyKpcnKernels(logits,
                         {{inputs.demodulated[0].data(), inputs.demodulated[1].data(),
                           inputs.demodulated[2].data()},
                          area,
                          inner,
                          frame.width,
                          frame.height},
                         BestKpcn(), out);
        for (int y = inner.y0; y < inner.y1; ++y) {
            for (std::size_t c = 0; c < 3; ++c) {
                float* to = out[c]->data() + static_cast<std::ptrdiff_t>(y) * frame.width;
                const float* divisor = inputs.divisor[c].data() +
                                       static_cast<std::ptrdiff_t>(y - area.y0) * area.width() -
                                       area.x0;
                for (int x = inner.x0; x < inner.x1; ++x) {
                    to[x] *= divisor[x];
                }
            }
        }
    }

    static Plane EstimateError(const Frame& frame, const Result& result, const Plane& own) {
        Plane sure(frame.pixel_count());
        for (std::size_t i = 0; i < sure.size(); ++i) {
            float sum = 0;
            for (std::size_t c = 0; c < 3; ++c) {
                const float moved = result.color[c][i] - frame.color[c][i];
                sum += moved * moved + frame.variance[c][i] * (2 * own[i] - 1);
            }
            sure[i] = sum / 3;
        }
        return BlurGaussian(sure, frame.width, frame.height, kSureBlur);
    }

    std::string size_;
    std::shared_ptr<const Network> network_;
    int radius_;  // of the windows, pixels
};

std::shared_ptr<const Network> MakeNetwork(const TensorArchive& weights,
                                           const std::string& source) {
    auto network = std::make_shared<const Network>(PlainStack(weights), weights, source);
    const int inputs = static_cast<int>(KpcnInputNames().size());
    if (network->input_channels() != inputs || RadiusOf(network->output_channels()) < 0) {
        ThrowInvalidArgument(
            fmt::format("{}: a network of {} inputs and {} outputs; filter 'kpcn' has {} inputs, "
                        "and the pixels of an odd window as outputs",
                        source, network->input_channels(), network->output_channels(), inputs));
    }
    return network;
}

std::shared_ptr<const Network> LoadNetwork(const std::string& size) {
    const std::string name = "relume_kpcn_" + size;
    const auto weights = FindNetworkWeights(name);
    if (!weights) {
        throw Error(ErrorCode::kFailedPrecondition,
                    fmt::format("filter 'kpcn': no weights '{}' in {}; train/kpcn.py makes them",
                                name, NetworkFolders()));
    }
    return MakeNetwork(weights->tensors, weights->source);
}

}  // namespace

void ApplyKpcnKernels(std::span<const Plane> logits, const KpcnArea& tile, KpcnKernel kernel,
                      const std::array<Plane*, kKpcnOutputs>& out) {
    const int radius = RadiusOf(static_cast<int>(logits.size()));
    const TileRect& inner = tile.inner;
    const int blocks = (inner.width() + kKpcnBlock - 1) / kKpcnBlock;
    // The image with its mirrored border, and whole blocks at the right.
    const std::ptrdiff_t stride = static_cast<std::ptrdiff_t>(blocks) * kKpcnBlock + 2 * radius;
    const std::ptrdiff_t rows = inner.height() + 2 * radius;
    std::array<Plane, 3> padded;
    for (std::size_t c = 0; c < 3; ++c) {
        padded[c].assign(static_cast<std::size_t>(stride * rows), 0.0f);
        for (std::ptrdiff_t v = 0; v < rows; ++v) {
            const int y = Mirror(inner.y0 - radius + static_cast<int>(v), tile.frame_height);
            const float* from =
                tile.image[c] + static_cast<std::ptrdiff_t>(y - tile.area.y0) * tile.area.width();
            for (int u = 0; u < inner.width() + 2 * radius; ++u) {
                const int x = Mirror(inner.x0 - radius + u, tile.frame_width);
                padded[c][static_cast<std::size_t>(v * stride + u)] = from[x - tile.area.x0];
            }
        }
    }
    ParallelFor(
        0, static_cast<std::size_t>(inner.height()), kRows,
        [&](std::size_t begin, std::size_t end) {
            std::vector<float> block(logits.size() * kKpcnBlock);
            float filtered[kKpcnOutputs * kKpcnBlock];
            for (auto row = static_cast<int>(begin); row < static_cast<int>(end); ++row) {
                const int y = inner.y0 + row;
                for (int x = inner.x0; x < inner.x1; x += kKpcnBlock) {
                    const int width = std::min(kKpcnBlock, inner.x1 - x);
                    const std::ptrdiff_t at =
                        static_cast<std::ptrdiff_t>(y - tile.area.y0) * tile.area.width() + x -
                        tile.area.x0;
                    for (std::size_t k = 0; k < logits.size(); ++k) {
                        std::copy_n(logits[k].data() + at, width, block.data() + k * kKpcnBlock);
                    }
                    const std::ptrdiff_t middle = (row + radius) * stride + radius + x - inner.x0;
                    const float* const image[3] = {padded[0].data() + middle,
                                                   padded[1].data() + middle,
                                                   padded[2].data() + middle};
                    kernel(block.data(), kKpcnBlock, image, stride, radius, filtered);
                    for (std::size_t s = 0; s < kKpcnOutputs; ++s) {
                        std::copy_n(
                            filtered + s * kKpcnBlock, width,
                            out[s]->data() + static_cast<std::ptrdiff_t>(y) * tile.frame_width + x);
                    }
                }
            }
        });
}

std::unique_ptr<Denoiser> MakeKpcn(const std::string& size, const TensorArchive& weights,
                                   const std::string& source) {
    return std::make_unique<Kpcn>(size, MakeNetwork(weights, source));
}

std::unique_ptr<Denoiser> MakeKpcn(const ParamSet& params) {
    if (params.GetChoice("size", "lite", {"lite", "full"}) == "full") {
        static const std::shared_ptr<const Network> full = LoadNetwork("full");
        return std::make_unique<Kpcn>("full", full);
    }
    static const std::shared_ptr<const Network> lite = LoadNetwork("lite");
    return std::make_unique<Kpcn>("lite", lite);
}

}  // namespace relume::denoise
