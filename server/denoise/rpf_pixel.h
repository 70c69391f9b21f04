#pragma once

#include <array>
#include <vector>

#include "server/denoise/rpf_information.h"
#include "server/denoise/rpf_kernels.h"
#include "server/denoise/rpf_rows.h"

namespace relume::denoise {

// What of a sample is compared with what, in columns.
enum RpfColumn : std::size_t {
    kRpfColor = 0,                  // 3
    kRpfFeature = 3,                // 18: two hits of position, normal, albedo
    kRpfRandom = kRpfFeature + 18,  // 5
    kRpfScreen = kRpfRandom + 5,    // 2, pixels from the pixel that is filtered
    kRpfColumnCount = kRpfScreen + 2,
};

// What a column may hold: one of a row's floats; and what that has to deviate by to be more than a
// constant with rounding.
struct RpfSource {
    std::size_t column;
    std::size_t from;
    float floor;
};

// The samples that one pixel is filtered by, its own ones first. Scratch of one thread.
class RpfNeighbourhood {
  public:
    RpfNeighbourhood(const std::vector<RpfSource>& sources, const RpfKernels& kernels);

    // Empties it; room for so many samples.
    void Clear(std::size_t room);
    // A sample of the pixel (x, y) away.
    void Add(const RpfRow& row, float x, float y) {
        for (const auto& [to, from] : copies_) {
            to[count_] = row.values[from];
        }
        columns_[kRpfScreen][count_] = x + row.values[kRpfRowPlace];
        columns_[kRpfScreen + 1][count_] = y + row.values[kRpfRowPlace + 1];
        ++count_;
    }
    std::size_t count() const { return count_; }

    // Brings all columns to mean 0 and deviation 1; those that vary by less than their floors are
    // of no say.
    void Normalise(const std::vector<double>& entropy_terms);

    // What the colours depend on, by mutual information (methods 2.5, steps 4 and 5): the columns'
    // coefficients in a weight's exponent. `t`: number of the pass; `variance`: of normalised
    // values.
    void FindWeights(int t, double variance, const std::vector<double>& entropy_terms);

    // The filtered colour of own sample i. FindWeights comes first.
    std::array<float, 3> Filter(std::size_t i) const;

  private:
    struct Copy {
        float* to;
        std::size_t from;
    };

    const RpfKernels& kernels_;
    std::size_t count_ = 0;
    std::vector<RpfSource> used_;  // columns, those of the place last
    std::vector<Copy> copies_;
    std::array<std::vector<float>, kRpfColumnCount> columns_;
    std::array<float, kRpfColumnCount> mean_{}, deviation_{};
    std::array<bool, kRpfColumnCount> varies_{};
    std::array<RoundedColumn, kRpfColumnCount> rounded_;
    std::vector<float> outside_;
    std::vector<const float*> compared_;
    std::vector<float> coefficients_;
};

}  // namespace relume::denoise
