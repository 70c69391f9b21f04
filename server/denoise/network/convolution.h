#pragma once

#include <memory>
#include <vector>

namespace relume::denoise {

// Channels that lie side by side in memory, as this processor's instructions like them: 16 or 8.
// Pixels of more channels are cut into groups of so many, the last filled up with zeros.
int ChannelLanes();
// Numbers of a vector in these instructions: 16, 8 or 4.
int VectorLanes();

// The convolution of a block of an image by one thread, float32: the one place that knows oneDNN.
struct ConvolutionShape {
    int inputs, outputs;  // channels, multiples of ChannelLanes()
    int kernel;           // odd: kernel x kernel
    int rows, columns;    // of the result, pixels
    bool relu;
};

// Weights of a layer, and what oneDNN has made of them: in as many layouts as blocks of different
// sizes ask for, each made once. Thread-safe.
class ConvolutionWeights {
  public:
    // `weights`: outputs x inputs x kernel x kernel, `bias`: outputs.
    ConvolutionWeights(std::vector<float> weights, std::vector<float> bias);
    ~ConvolutionWeights();
    ConvolutionWeights(ConvolutionWeights&&) noexcept;
    ConvolutionWeights& operator=(ConvolutionWeights&&) noexcept;

  private:
    friend class BlockConvolution;
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

class BlockConvolution {
  public:
    BlockConvolution(const ConvolutionShape& shape, const ConvolutionWeights& weights);
    ~BlockConvolution();
    BlockConvolution(BlockConvolution&&) noexcept;
    BlockConvolution& operator=(BlockConvolution&&) noexcept;

    // `from`: kernel - 1 more rows and columns than the result. Both: group of channels, row,
    // column, channel of the group. `scratch` is the thread's, grown as needed. Thread-safe; uses
    // no thread but the caller's.
    void Run(const float* from, float* to, std::vector<float>* scratch) const;

  private:
    struct Impl;
    std::unique_ptr<const Impl> impl_;
};

}  // namespace relume::denoise
