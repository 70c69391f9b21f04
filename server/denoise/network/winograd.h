#pragma once

#include <vector>

#include "server/denoise/network/plan_memory.h"
#include "server/denoise/network/winograd_kernels.h"

namespace relume::denoise {

// Weights of a 3x3 convolution as winograd_kernels.h wants them: 36 matrices, each in panels of
// outputs.
class WinogradWeights {
  public:
    // `weights`: outputs x inputs x 3 x 3, `bias`: outputs.
    WinogradWeights(const WinogradKernels& kernels, const std::vector<float>& weights,
                    const std::vector<float>& bias, int inputs);

    int inputs() const { return inputs_; }
    int outputs() const { return outputs_; }  // filled up with zeros to whole vectors
    const float* bias() const { return bias_.get(); }

    // 36 matrices of sums, `to_step` floats from one to the next, each count x outputs(), of 36
    // matrices of transformed pixels, each count x pitch, the first inputs() of a row used.
    void Multiply(const float* tiles, std::ptrdiff_t step, std::ptrdiff_t pitch, int count,
                  float* to, std::ptrdiff_t to_step) const;

  private:
    struct Panel {
        int first, vectors;  // output, of `lanes` outputs
    };

    const WinogradKernels* kernels_;
    int inputs_, outputs_;
    std::vector<Panel> panels_;
    PlanBuffer matrices_, bias_;
};

}  // namespace relume::denoise
