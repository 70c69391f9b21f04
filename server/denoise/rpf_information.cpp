#include "server/denoise/rpf_information.h"

#include <algorithm>
#include <array>

namespace relume::denoise {

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

void RoundedColumn::Set(float* values, std::size_t count, float mean, float scale,
                        const std::vector<double>& entropy_terms, const RpfKernels& kernels) {
    constexpr std::uint8_t kNone = 255;
    const std::size_t padded = (count + kRpfBlock - 1) / kRpfBlock * kRpfBlock;
    const std::size_t words = (count + kRpfWord - 1) / kRpfWord;
    bins_.resize(std::max(bins_.size(), words * kRpfWord));
    masks_.resize(std::max(masks_.size(), words * kRpfBins));
    kernels.normalise(values, static_cast<int>(padded), mean, scale, bins_.data());
    std::fill(bins_.begin() + static_cast<std::ptrdiff_t>(count),
              bins_.begin() + static_cast<std::ptrdiff_t>(words * kRpfWord), kNone);
    std::array<std::uint32_t, kRpfBins> counts;
    kernels.make_masks(bins_.data(), static_cast<int>(words), masks_.data(), counts.data());
    count_ = count;
    words_ = static_cast<int>(words);
    occupied_ = 0;
    terms_ = 0;
    for (std::size_t bin = 0; bin < kRpfBins; ++bin) {
        if (counts[bin] > 0) {
            const auto at = static_cast<std::size_t>(occupied_++);
            mask_[at] = masks_.data() + bin * words;
            in_bin_[at] = counts[bin];
            terms_ += entropy_terms[counts[bin]];
            if (at > 0 && in_bin_[at] < in_bin_[at - 1]) {
                std::swap(in_bin_[at], in_bin_[at - 1]);
                std::swap(mask_[at], mask_[at - 1]);
            }
        }
    }
}

// I = sum n_ab / N log(n_ab N / (n_a n_b)). The fullest bins' counts follow from the others.
double MutualInformation(const RoundedColumn& a, const RoundedColumn& b,
                         const std::vector<double>& entropy_terms, const RpfKernels& kernels) {
    const int rows = a.occupied_ - 1, columns = b.occupied_ - 1;
    if (rows < 1 || columns < 1) {
        return 0;
    }
    std::array<std::uint32_t, kRpfBins * kRpfBins> both;
    kernels.count_both(a.mask_.data(), rows, b.mask_.data(), columns, a.words_, both.data());
    double joint = 0;
    std::array<std::uint32_t, kRpfBins> left = b.in_bin_;
    std::uint32_t corner = a.in_bin_[static_cast<std::size_t>(rows)];
    for (int i = 0; i < rows; ++i) {
        std::uint32_t rest = a.in_bin_[static_cast<std::size_t>(i)];
        for (int j = 0; j < columns; ++j) {
            const std::uint32_t n = both[static_cast<std::size_t>(i * columns + j)];
            rest -= n;
            left[static_cast<std::size_t>(j)] -= n;
            joint += entropy_terms[n];
        }
        joint += entropy_terms[rest];
    }
    for (int j = 0; j < columns; ++j) {
        corner -= left[static_cast<std::size_t>(j)];
        joint += entropy_terms[left[static_cast<std::size_t>(j)]];
    }
    joint += entropy_terms[corner];
    return std::max(0.0, joint - a.terms_ - b.terms_ + entropy_terms[a.count_]) /
           static_cast<double>(a.count_);
}

}  // namespace relume::denoise
