#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/base/cancel_token.h"
#include "server/denoise/frame.h"
#include "server/denoise/network/tza.h"

namespace relume::denoise {

enum class LayerKind {
    kConvolution,  // odd square kernel, stride 1, zeros beyond the border, so that the size stays
    kPool,         // maximum of 2x2
    kUpsample,     // each pixel becomes 2x2
    kConcatenate,  // channels one after another
};

struct LayerSpec {
    LayerKind kind;
    std::string name;                 // of the output; of a convolution also of its weights
    std::vector<std::string> inputs;  // names of layers above; "input" is the network's
    bool relu = false;                // convolutions: negative results become 0
};

// A network's shape. The channels and kernels of a convolution are those of the tensors
// NAME.weight (outputs, inputs, height, width) and NAME.bias; the last layer, a convolution, is the
// output, at the size of the input.
struct GraphSpec {
    std::vector<LayerSpec> layers;
};

inline LayerSpec Convolution(std::string name, std::string input, bool relu = true) {
    return {LayerKind::kConvolution, std::move(name), {std::move(input)}, relu};
}
inline LayerSpec Pool(std::string name, std::string input) {
    return {LayerKind::kPool, std::move(name), {std::move(input)}};
}
inline LayerSpec Upsample(std::string name, std::string input) {
    return {LayerKind::kUpsample, std::move(name), {std::move(input)}};
}
inline LayerSpec Concatenate(std::string name, std::vector<std::string> inputs) {
    return {LayerKind::kConcatenate, std::move(name), std::move(inputs)};
}

// A network ready to run: float32, 3x3 convolutions by Winograd's way (network/winograd_kernels.h)
// where there is AVX2 or AVX-512, others by oneDNN.
//
// The same bits for any number of threads: images are cut into tiles and blocks by their size
// alone, and each is one thread's. The instructions are those that the processor has, and sums are
// in the order that suits them (errors of Winograd's way are some 1e-6 of the largest values near
// by): results of different processors differ by rounding.
class Network {
  public:
    // A graph that the weights don't fit throws kInvalidArgument, which names `source` and the
    // layer.
    Network(const GraphSpec& graph, const TensorArchive& weights, const std::string& source);
    ~Network();
    Network(Network&&) noexcept;
    Network& operator=(Network&&) noexcept;

    int input_channels() const;
    int output_channels() const;
    // Sides are padded with zeros to the right and below to a multiple of this: 2 to the number of
    // poolings one after another.
    int alignment() const;
    // Pixels to each side of one that its output depends on, at most, but for rounding.
    int halo() const;

    // `inputs`: a plane a channel, each width x height, row-major. Returns as many planes as there
    // are outputs. Thread-safe. A frame whose tensors would take more than `most_bytes` at one time
    // is done in tiles that overlap by the halo, the same but for rounding: the default is met by
    // some five megapixels of Open Image Denoise's base network. Throws kCancelled soon after
    // `cancel` is set.
    static constexpr std::size_t kMostBytes = std::size_t{1} << 30;
    std::vector<Plane> Run(std::span<const float* const> inputs, int width, int height,
                           const CancelToken& cancel, std::size_t most_bytes = kMostBytes) const;

  private:
    struct Impl;
    std::unique_ptr<const Impl> impl_;
};

}  // namespace relume::denoise
