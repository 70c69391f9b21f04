#pragma once

#include <memory>
#include <vector>

namespace relume::denoise {

// Channels that lie side by side in memory, as this processor's instructions like them: 16 or 8.
// Pixels of more channels are cut into groups of so many, the last filled up with zeros.
int ChannelLanes();

// The convolution of a block of an image by one thread, float32: the one place that knows oneDNN.
struct ConvolutionShape {
    int inputs, outputs;  // channels, multiples of ChannelLanes()
    int kernel;           // odd: kernel x kernel
    int rows, columns;    // of the result, pixels
    bool relu;
};

class BlockConvolution {
  public:
    // `weights`: outputs x inputs x kernel x kernel, `bias`: outputs. Both are copied; or shared
    // with `like`, which has the same and other rows and columns, if there is one.
    BlockConvolution(const ConvolutionShape& shape, const std::vector<float>& weights,
                     const std::vector<float>& bias, const BlockConvolution* like);
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
