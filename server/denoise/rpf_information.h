#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "server/denoise/rpf_kernels.h"

namespace relume::denoise {

// n log n (natural) for n from 0 to `most`, by sums and products alone: libm's bits depend on the
// processor.
std::vector<double> EntropyTerms(std::size_t most);

// A column of numbers rounded to whole ones: ten bins, as masks of the samples that are in them.
class RoundedColumn {
  public:
    // Scales the column by mean and deviation, and rounds it: bins from -5 to 4, what is beyond
    // goes to the last ones. `values` has room for a multiple of kRpfBlock; `terms` must reach
    // `count`.
    void Set(float* values, std::size_t count, float mean, float scale,
             const std::vector<double>& entropy_terms, const RpfKernels& kernels);

  private:
    friend double MutualInformation(const RoundedColumn& a, const RoundedColumn& b,
                                    const std::vector<double>& entropy_terms,
                                    const RpfKernels& kernels);

    std::vector<std::uint8_t> bins_;
    std::vector<std::uint64_t> masks_;
    std::size_t count_ = 0;
    int words_ = 0, occupied_ = 0;
    // Of the bins that anything is in, the fullest last.
    std::array<const std::uint64_t*, kRpfBins> mask_{};
    std::array<std::uint32_t, kRpfBins> in_bin_{};
    double terms_ = 0;  // sum of n log n over the bins' counts
};

// Mutual information of two columns of one length, by their joint histogram, nats; 0 or more.
double MutualInformation(const RoundedColumn& a, const RoundedColumn& b,
                         const std::vector<double>& entropy_terms, const RpfKernels& kernels);

}  // namespace relume::denoise
