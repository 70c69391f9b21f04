#pragma once

#include <cstddef>
#include <memory>
#include <vector>

namespace relume::denoise {

// The convolution of a band of rows by one thread, float32: the one place that knows oneDNN.
struct ConvolutionShape {
    int inputs, outputs;  // channels
    int kernel;           // odd: kernel x kernel
    int width, rows;      // of the result, pixels
    bool relu;
};

class BandConvolution {
  public:
    // `weights`: outputs x inputs x kernel x kernel, `bias`: outputs; both are copied.
    BandConvolution(const ConvolutionShape& shape, const std::vector<float>& weights,
                    const std::vector<float>& bias);
    ~BandConvolution();
    BandConvolution(BandConvolution&&) noexcept;
    BandConvolution& operator=(BandConvolution&&) noexcept;

    // `from`: rows + kernel - 1 rows of width pixels of `inputs` numbers; `to`: rows rows of width
    // pixels of `outputs`. What is left and right of the rows counts as 0. Thread-safe; uses no
    // thread but the caller's.
    void Run(const float* from, float* to) const;

  private:
    struct Impl;
    std::unique_ptr<const Impl> impl_;
};

}  // namespace relume::denoise
