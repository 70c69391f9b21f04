#pragma once

#include <array>
#include <vector>

#include "server/denoise/rpf_information.h"
#include "server/denoise/rpf_kernels.h"

namespace relume::denoise {

// What of a sample is compared with what, in columns.
enum RpfColumn : std::size_t {
    kRpfColor = 0,                  // 3
    kRpfFeature = 3,                // 18: two hits of position, normal, albedo
    kRpfRandom = kRpfFeature + 18,  // 5
    kRpfScreen = kRpfRandom + 5,    // 2, pixels from the pixel that is filtered
    kRpfColumnCount = kRpfScreen + 2,
};

// The samples that one pixel is filtered by, its own ones first. Scratch of one thread.
class RpfNeighbourhood {
  public:
    void Clear(std::size_t own) {
        own_ = own;
        count_ = 0;
    }
    // Room for so many samples.
    void Reserve(std::size_t samples);
    void Add(const std::array<float, kRpfColumnCount>& sample) {
        for (std::size_t c = 0; c < kRpfColumnCount; ++c) {
            columns_[c][count_] = sample[c];
        }
        ++count_;
    }
    std::size_t count() const { return count_; }

    // Brings all columns to mean 0 and deviation 1; those that vary by less than `floors` are
    // constant: 0 everywhere, and of no say.
    void Normalise(const std::array<double, kRpfColumnCount>& floors);

    // What the colours depend on, by mutual information (methods 2.5, steps 4 and 5): the columns'
    // coefficients in a weight's exponent. `t`: number of the pass; `variance`: of normalised
    // values.
    void FindWeights(int t, double variance, const std::vector<double>& entropy_terms);

    // The filtered colour of own sample i. FindWeights comes first.
    std::array<float, 3> Filter(std::size_t i, RpfKernel kernel) const;

  private:
    std::size_t own_ = 0, count_ = 0;
    std::array<std::vector<float>, kRpfColumnCount> columns_;
    std::array<double, kRpfColumnCount> mean_{}, deviation_{};
    std::array<bool, kRpfColumnCount> varies_{};
    std::array<RoundedColumn, kRpfColumnCount> rounded_;
    std::vector<float> outside_;
    std::vector<const float*> compared_;
    std::vector<float> coefficients_;
};

}  // namespace relume::denoise
