#include "server/denoise/rpf_pixel.h"

#include <algorithm>
#include <cmath>

namespace relume::denoise {
namespace {

constexpr double kEpsilon = 1e-10;
constexpr float kOutside = 1e6f;

std::size_t Padded(std::size_t count) { return (count + kRpfBlock - 1) / kRpfBlock * kRpfBlock; }

double AddUp(const float* partial) {
    double sum = 0;
    for (int k = 0; k < kRpfBlock; ++k) {
        sum += partial[k];
    }
    return sum;
}

}  // namespace

RpfNeighbourhood::RpfNeighbourhood(const std::vector<RpfSource>& sources, const RpfKernels& kernels)
    : kernels_(kernels), used_(sources) {
    for (std::size_t c = kRpfScreen; c < kRpfColumnCount; ++c) {
        used_.push_back({c, 0, 0});
    }
    copies_.resize(sources.size());
}

void RpfNeighbourhood::Clear(std::size_t room) {
    count_ = 0;
    if (outside_.size() >= Padded(room)) {
        return;
    }
    outside_.resize(Padded(room));
    for (const RpfSource& source : used_) {
        columns_[source.column].resize(Padded(room));
    }
    for (std::size_t k = 0; k < copies_.size(); ++k) {
        copies_[k] = {columns_[used_[k].column].data(), used_[k].from};
    }
}

void RpfNeighbourhood::Normalise(const std::vector<double>& entropy_terms) {
    const std::size_t padded = Padded(count_);
    const auto n = static_cast<double>(count_);
    std::array<float, kRpfBlock> partial;
    for (const auto& [c, from, floor] : used_) {
        float* values = columns_[c].data();
        // Of distances to one of them, which are small where a mean may be large. What pads the
        // column counts for nothing.
        const float base = values[0];
        std::fill(values + count_, values + padded, base);
        kernels_.sum(values, static_cast<int>(padded), base, partial.data());
        const double mean = base + AddUp(partial.data()) / n;
        mean_[c] = static_cast<float>(mean);
        std::fill(values + count_, values + padded, mean_[c]);
        kernels_.sum_squares(values, static_cast<int>(padded), mean_[c], partial.data());
        const double deviation = std::sqrt(AddUp(partial.data()) / n);
        varies_[c] = std::isfinite(deviation) && deviation > static_cast<double>(floor) &&
                     deviation > 1e-6 * std::abs(mean);
        deviation_[c] = varies_[c] ? static_cast<float>(deviation) : 0;
        const float scale = varies_[c] ? static_cast<float>(1 / deviation) : 0;
        if (varies_[c] || c < kRpfFeature) {
            rounded_[c].Set(values, count_, mean_[c], scale, entropy_terms, kernels_);
        }
    }
    std::fill(outside_.begin(), outside_.begin() + static_cast<std::ptrdiff_t>(count_), 0.0f);
    std::fill(outside_.begin() + static_cast<std::ptrdiff_t>(count_),
              outside_.begin() + static_cast<std::ptrdiff_t>(padded), kOutside);
}

void RpfNeighbourhood::FindWeights(int t, double variance,
                                   const std::vector<double>& entropy_terms) {
    const auto information = [&](std::size_t a, std::size_t b) {
        return varies_[a] && varies_[b]
                   ? MutualInformation(rounded_[a], rounded_[b], entropy_terms, kernels_)
                   : 0.0;
    };
    const auto with_all = [&](std::size_t column, std::size_t begin, std::size_t end) {
        double sum = 0;
        for (std::size_t c = begin; c < end; ++c) {
            sum += information(column, c);
        }
        return sum;
    };
    const double shrink = 1 + 0.1 * t;

    // The share of the random numbers in what a colour depends on.
    double random_and_screen = 0, share = 0, varying = 0;
    std::array<double, 3> alpha{};
    for (std::size_t c = 0; c < 3; ++c) {
        const double random = with_all(kRpfColor + c, kRpfRandom, kRpfScreen);
        const double screen = with_all(kRpfColor + c, kRpfScreen, kRpfColumnCount);
        const double w = random / (random + screen + kEpsilon);
        alpha[c] = std::max(0.0, 1 - 2 * shrink * w);
        random_and_screen += random + screen;
        share += varies_[kRpfColor + c] ? w : 0;
        varying += varies_[kRpfColor + c] ? 1 : 0;
    }
    share /= std::max(varying, 1.0);

    // Features: by how much colours depend on them, and they themselves not on random numbers.
    std::array<double, kRpfRandom - kRpfFeature> of_color{}, beta{};
    double all_features = 0;
    for (std::size_t k = 0; k < of_color.size(); ++k) {
        of_color[k] = with_all(kRpfFeature + k, kRpfColor, kRpfFeature);
        all_features += of_color[k];
    }
    for (std::size_t k = 0; k < beta.size(); ++k) {
        if (!varies_[kRpfFeature + k] || of_color[k] == 0) {
            continue;
        }
        const double random = with_all(kRpfFeature + k, kRpfRandom, kRpfScreen);
        const double screen = with_all(kRpfFeature + k, kRpfScreen, kRpfColumnCount);
        beta[k] = of_color[k] / (random_and_screen + all_features + kEpsilon) *
                  std::max(0.0, 1 - shrink * random / (random + screen + kEpsilon));
    }

    compared_.clear();
    coefficients_.clear();
    const double scale = (1 - share) * (1 - share) / (2 * variance);
    const auto compare = [&](std::size_t column, double weight) {
        if (varies_[column] && weight * scale > 0) {
            compared_.push_back(columns_[column].data());
            coefficients_.push_back(static_cast<float>(weight * scale));
        }
    };
    for (std::size_t c = 0; c < alpha.size(); ++c) {
        compare(kRpfColor + c, alpha[c]);
    }
    for (std::size_t k = 0; k < beta.size(); ++k) {
        compare(kRpfFeature + k, beta[k]);
    }
}

std::array<float, 3> RpfNeighbourhood::Filter(std::size_t i) const {
    RpfColumns columns;
    columns.count = static_cast<int>(Padded(count_));
    columns.outside = outside_.data();
    columns.compared = compared_.data();
    columns.coefficients = coefficients_.data();
    columns.compared_count = static_cast<int>(compared_.size());
    for (std::size_t c = 0; c < 3; ++c) {
        columns.color[c] = columns_[kRpfColor + c].data();
    }
    std::array<float, 4 * kRpfBlock> partial;
    kernels_.weigh(columns, static_cast<int>(i), partial.data());
    std::array<double, 4> sums{};
    for (std::size_t k = 0; k < sums.size(); ++k) {
        for (std::size_t j = 0; j < kRpfBlock; ++j) {
            sums[k] += partial[k * kRpfBlock + j];
        }
    }
    // Colours were averaged as distances from their mean, in deviations: those are small numbers
    // however bright the samples are. The own sample's weight is 1.
    std::array<float, 3> color;
    for (std::size_t c = 0; c < 3; ++c) {
        color[c] = static_cast<float>(mean_[kRpfColor + c] +
                                      deviation_[kRpfColor + c] * (sums[c + 1] / sums[0]));
    }
    return color;
}

}  // namespace relume::denoise
