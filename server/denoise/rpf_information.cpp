#include "server/denoise/rpf_information.h"

#include <algorithm>
#include <array>

namespace relume::denoise {
namespace {

constexpr int kRow = 16;  // bins of a histogram's row, the last six unused
constexpr int kCells = 10 * kRow;

}  // namespace

std::vector<double> EntropyTerms(std::size_t most) {
    std::vector<double> terms(most + 1, 0.0);
    double log = 0;
    for (std::size_t n = 2; n <= most; ++n) {
        // log n - log(n - 1) = 2 artanh(1 / (2n - 1)), whose series ends where it changes nothing.
        const double x = 1 / (2 * static_cast<double>(n) - 1);
        double power = x, sum = 0;
        for (int k = 1; k < 40 && sum + power / k != sum; k += 2) {
            sum += power / k;
            power *= x * x;
        }
        log += 2 * sum;
        terms[n] = static_cast<double>(n) * log;
    }
    return terms;
}

void RoundedColumn::Round(const float* values, std::size_t count,
                          const std::vector<double>& entropy_terms) {
    bins.resize(count);
    for (std::size_t j = 0; j < count; ++j) {
        const float value = std::min(std::max(values[j], -5.0f), 4.0f);
        bins[j] = static_cast<std::uint8_t>(value + 5.5f);
    }
    std::array<std::uint32_t, kRow> counts{};
    for (const std::uint8_t bin : bins) {
        ++counts[bin];
    }
    terms = 0;
    for (const std::uint32_t n : counts) {
        terms += entropy_terms[n];
    }
}

// I = sum n_ab / N log(n_ab N / (n_a n_b)).
double MutualInformation(const RoundedColumn& a, const RoundedColumn& b,
                         const std::vector<double>& entropy_terms) {
    // Four at once: samples in a row often fall into one cell, whose count would be waited for.
    std::array<std::array<std::uint32_t, kCells>, 4> counts{};
    const std::size_t size = a.bins.size();
    const std::uint8_t *row = a.bins.data(), *column = b.bins.data();
    std::size_t j = 0;
    for (; j + 4 <= size; j += 4) {
        ++counts[0][static_cast<std::size_t>(row[j] * kRow + column[j])];
        ++counts[1][static_cast<std::size_t>(row[j + 1] * kRow + column[j + 1])];
        ++counts[2][static_cast<std::size_t>(row[j + 2] * kRow + column[j + 2])];
        ++counts[3][static_cast<std::size_t>(row[j + 3] * kRow + column[j + 3])];
    }
    for (; j < size; ++j) {
        ++counts[0][static_cast<std::size_t>(row[j] * kRow + column[j])];
    }
    double joint = 0;
    for (std::size_t cell = 0; cell < kCells; ++cell) {
        joint +=
            entropy_terms[counts[0][cell] + counts[1][cell] + counts[2][cell] + counts[3][cell]];
    }
    return std::max(0.0, joint - a.terms - b.terms + entropy_terms[size]) /
           static_cast<double>(std::max<std::size_t>(size, 1));
}

}  // namespace relume::denoise
