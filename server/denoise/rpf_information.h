#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace relume::denoise {

// n log n (natural) for n from 0 to `most`, by sums and products alone: libm's bits depend on the
// processor.
std::vector<double> EntropyTerms(std::size_t most);

// A column of numbers of mean 0 and deviation 1, rounded to whole ones: ten bins from -5 to 4, what
// is beyond goes to the last ones.
struct RoundedColumn {
    std::vector<std::uint8_t> bins;
    double terms = 0;  // sum of n log n over the bins' counts

    // `terms` must reach `count`.
    void Round(const float* values, std::size_t count, const std::vector<double>& entropy_terms);
};

// Mutual information of two columns of one length, by their joint histogram, nats; 0 or more.
double MutualInformation(const RoundedColumn& a, const RoundedColumn& b,
                         const std::vector<double>& entropy_terms);

}  // namespace relume::denoise
