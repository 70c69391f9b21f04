// "Ours with CNN" as Xing, Chen, Li 2020 print it (section 3.4, Fig. 12; methods 3.8): a network
// says for each pixel the parameters of the cross-bilateral filter of equations (7) to (9):
// sigma_s, sigma_r, and sigma of normal, albedo ("texture") and depth.
//
// What the paper prints: three stages of 3x3 convolutions, the middle one of 64 layers with 128
// features: 9.4 million multiplications a pixel, minutes for a megapixel. Here: a plain stack of as
// many convolutions as there are weights, by default six of 32 features, without the residual
// connections that 64 would need to be trained. What it leaves open: the inputs
// (net_printed_inputs.h); sigma = 0.01 + softplus of the outputs; window 17x17, clipped at the
// border; training by relative L1 of the filtered image. To the letter: D of (8) without a square,
// by the variance of one sample, floor 1e-10; range differences in linear radiance.
//
// The estimated error is SURE with the sigmas taken for fixed, although the network has seen the
// noise: too low where it follows it.
#include "server/denoise/net_printed.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/base/error.h"
#include "core/base/parallel.h"
#include "server/denoise/net_printed_inputs.h"
#include "server/denoise/network/network.h"
#include "server/denoise/network/plain_stack.h"
#include "server/denoise/network/weights.h"
#include "server/denoise/planes.h"

namespace relume::denoise {
namespace {

constexpr const char* kWeights = "relume_printed";  // their name
constexpr std::size_t kSigmas = 5;
constexpr const char* kSigmaNames[kSigmas] = {"sigma_s", "sigma_r", "sigma_n", "sigma_a",
                                              "sigma_d"};
constexpr float kLeastSigma = 0.01f, kMostSigma = 1e4f;
constexpr std::size_t kPixels = 4096;  // a task
constexpr float kSureBlur = 4;         // pixels: SURE of one pixel is mostly noise (methods 1.5)

// Sigma of an output: 0.01 + log(1 + exp(x)).
float Sigma(float x) {
    return std::clamp(kLeastSigma + std::max(x, 0.0f) + std::log1p(std::exp(-std::abs(x))),
                      kLeastSigma, kMostSigma);
}

void ToSigmas(std::vector<Plane>* outputs) {
    for (Plane& plane : *outputs) {
        ParallelFor(0, plane.size(), kPixels, [&](std::size_t begin, std::size_t end) {
            std::transform(plane.data() + begin, plane.data() + end, plane.data() + begin, Sigma);
        });
    }
}

Plane EstimateError(const Frame& frame, const Result& result) {
    Plane sure(frame.pixel_count());
    for (std::size_t i = 0; i < sure.size(); ++i) {
        float sum = 0;
        for (std::size_t c = 0; c < 3; ++c) {
            const float moved = result.color[c][i] - frame.color[c][i];
            sum += moved * moved + frame.variance[c][i] * (2 * (*result.derivative)[c][i] - 1);
        }
        sure[i] = sum / 3;
    }
    return BlurGaussian(sure, frame.width, frame.height, kSureBlur);
}

class PrintedNet final : public Denoiser {
  public:
    explicit PrintedNet(std::shared_ptr<const Network> network) : network_(std::move(network)) {}

    std::string Describe() const override { return "net:mode=printed"; }

    Result Reconstruct(const Frame& frame, const CancelToken& cancel) const override {
        const Guides guides = MakeGuides(frame);
        std::vector<Plane> sigmas;
        {
            const std::vector<Plane> inputs = MakePrintedNetInputs(frame, guides);
            std::vector<const float*> planes;
            for (const Plane& plane : inputs) {
                planes.push_back(plane.data());
            }
            sigmas = network_->Run(planes, frame.width, frame.height, cancel);
        }
        ToSigmas(&sigmas);
        Result result = FilterBySigmas(frame, guides, sigmas, BestNetPrinted(), cancel);
        result.error = EstimateError(frame, result);
        result.derivative.reset();  // the sigmas depend on the pixel, too
        result.notes["features"] = guides.names.empty() ? "none" : guides.names;
        for (std::size_t k = 0; k < kSigmas; ++k) {
            double sum = 0;
            for (const float sigma : sigmas[k]) {
                sum += sigma;
            }
            result.notes[kSigmaNames[k]] =
                fmt::format("{:.3g} in the mean",
                            sum / static_cast<double>(std::max<std::size_t>(sigmas[k].size(), 1)));
        }
        return result;
    }

  private:
    std::shared_ptr<const Network> network_;
};

std::shared_ptr<const Network> MakeNetwork(const TensorArchive& weights,
                                           const std::string& source) {
    auto network = std::make_shared<const Network>(PlainStack(weights), weights, source);
    const int inputs = static_cast<int>(PrintedNetInputNames().size());
    if (network->input_channels() != inputs ||
        network->output_channels() != static_cast<int>(kSigmas)) {
        ThrowInvalidArgument(fmt::format(
            "{}: a network of {} inputs and {} outputs; filter 'net:mode=printed' has "
            "{} and {}",
            source, network->input_channels(), network->output_channels(), inputs, kSigmas));
    }
    return network;
}

}  // namespace

Result FilterBySigmas(const Frame& frame, const Guides& guides, const std::vector<Plane>& sigmas,
                      NetPrintedKernel kernel, const CancelToken& cancel) {
    Result result;
    result.derivative.emplace();
    for (std::size_t c = 0; c < 3; ++c) {
        result.color[c].resize(frame.pixel_count());
        (*result.derivative)[c].resize(frame.pixel_count());
    }
    std::vector<Plane> scales;
    for (const Plane& plane : sigmas) {
        Plane& scale = scales.emplace_back(plane.size());
        std::ranges::transform(plane, scale.begin(),
                               [](float sigma) { return 0.5f / (sigma * sigma); });
    }
    const Plane inside(frame.pixel_count(), 1.0f);
    ForEachTile(
        frame, kNetPrintedPlanes, kNetPrintedRadius, cancel,
        [&](const TileArea& tile, TilePlanes& scratch) {
            const auto load = [&](int index, const Plane& plane) {
                scratch.Load(index, plane, frame.width, frame.height, tile.x0, tile.y0, 0);
            };
            for (int c = 0; c < 3; ++c) {
                load(kNetPrintedColor + c, frame.color[c]);
                load(kNetPrintedVariance + c, guides.variance[c]);
            }
            for (int f = 0; f < 7; ++f) {
                load(kNetPrintedNormal + f, guides.feature[f]);
            }
            load(kNetPrintedInside, inside);
            for (int k = 0; k < static_cast<int>(kSigmas); ++k) {
                load(kNetPrintedScale + k, scales[static_cast<std::size_t>(k)]);
            }
            std::vector<float> out(static_cast<std::size_t>(kNetPrintedOutputs * kTileArea));
            kernel(scratch.planes(), scratch.stride(), tile.height, out.data());
            for (int y = 0; y < tile.height; ++y) {
                for (int x = 0; x < tile.width; ++x) {
                    const auto i = static_cast<std::size_t>(tile.y0 + y) * frame.width +
                                   static_cast<std::size_t>(tile.x0 + x);
                    const float* from = out.data() + y * kTileWidth + x;
                    const float weight = from[3 * kTileArea];
                    for (std::size_t c = 0; c < 3; ++c) {
                        const float filtered = from[c * kTileArea];
                        const float moved = filtered - frame.color[c][i];
                        // Methods 1.5: the pixel's own weight, and the window's variance over
                        // sigma_r^2.
                        const float spread =
                            std::max(from[(4 + c) * kTileArea] / weight - moved * moved, 0.0f);
                        result.color[c][i] = filtered;
                        (*result.derivative)[c][i] = 1 / weight + 2 * scales[1][i] * spread;
                    }
                }
            }
        });
    return result;
}

std::unique_ptr<Denoiser> MakePrintedNet(const TensorArchive& weights, const std::string& source) {
    return std::make_unique<PrintedNet>(MakeNetwork(weights, source));
}

std::unique_ptr<Denoiser> MakePrintedNet() {
    static const std::shared_ptr<const Network> network = [] {
        const auto weights = FindNetworkWeights(kWeights);
        if (!weights) {
            throw Error(ErrorCode::kFailedPrecondition,
                        fmt::format("filter 'net:mode=printed': no weights '{}' in {}; "
                                    "train/printed.py makes them",
                                    kWeights, NetworkFolders()));
        }
        return MakeNetwork(weights->tensors, weights->source);
    }();
    return std::make_unique<PrintedNet>(network);
}

}  // namespace relume::denoise
