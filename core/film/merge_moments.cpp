#include "core/film/merge_moments.h"

#include <algorithm>
#include <limits>

#include "core/base/clones.h"

namespace relume {
namespace {

using BlockRow = std::array<float, kMomentsBlock>;
using Weights = std::array<double, kMomentsBlock>;

// How two sets of n_a and n_b samples are put together: n_b / n, and n_a n_b / n.
RELUME_CLONES void MergeWeights(const float* __restrict mine, const float* __restrict later,
                                double* __restrict share, double* __restrict spread) {
    for (std::size_t k = 0; k < kMomentsBlock; ++k) {
        const double a = mine[k], b = later[k], n = a + b;
        share[k] = b / (n > 0 ? n : 1);
        spread[k] = a * share[k];
    }
}

RELUME_CLONES void MergeMeans(const double* __restrict share, const float* __restrict later,
                              float* __restrict mean) {
    for (std::size_t k = 0; k < kMomentsBlock; ++k) {
        const double m = mean[k];
        mean[k] = static_cast<float>(m + (later[k] - m) * share[k]);
    }
}

// Sums of squared deviations from `mean` and `later_mean`. The square of a finite radiance may be
// larger than any float.
RELUME_CLONES void MergeM2(const double* __restrict spread, const double* __restrict mean,
                           const double* __restrict later_mean, const float* __restrict later,
                           float* __restrict m2) {
    constexpr double kLargest = std::numeric_limits<float>::max();
    for (std::size_t k = 0; k < kMomentsBlock; ++k) {
        const double delta = later_mean[k] - mean[k];
        const double sum = static_cast<double>(m2[k]) + later[k] + delta * delta * spread[k];
        m2[k] = static_cast<float>(sum < kLargest ? sum : kLargest);
    }
}

// Means of both halves together.
RELUME_CLONES void JoinMeans(const float* __restrict share_b, const float* __restrict mean_a,
                             const float* __restrict mean_b, double* __restrict mean) {
    for (std::size_t k = 0; k < kMomentsBlock; ++k) {
        const double a = mean_a[k], b = mean_b[k];
        mean[k] = a + (b - a) * share_b[k];
    }
}

RELUME_CLONES void Widen(const float* __restrict from, double* __restrict to) {
    for (std::size_t k = 0; k < kMomentsBlock; ++k) {
        to[k] = from[k];
    }
}

RELUME_CLONES void AddRow(const float* __restrict later, float* __restrict sum) {
    for (std::size_t k = 0; k < kMomentsBlock; ++k) {
        sum[k] += later[k];
    }
}

// The count of both halves, and half b's share in it.
RELUME_CLONES void CountBoth(const float* __restrict a, const float* __restrict b,
                             float* __restrict both, float* __restrict share_b) {
    for (std::size_t k = 0; k < kMomentsBlock; ++k) {
        both[k] = a[k] + b[k];
        share_b[k] = b[k] / std::max(both[k], 1.0f);
    }
}

}  // namespace

void MergeMoments(const MomentsBlock& later, MomentsBlock* moments) {
    MomentsBlock& m = *moments;
    const auto row = [](int channel) { return static_cast<std::size_t>(channel); };
    Weights share, spread, mean, later_mean;
    BlockRow mine_both, later_both, mine_share_b, later_share_b;
    CountBoth(m[kCountA].data(), m[kCountB].data(), mine_both.data(), mine_share_b.data());
    CountBoth(later[kCountA].data(), later[kCountB].data(), later_both.data(),
              later_share_b.data());

    // Features of both halves first: they need the halves' means as they were.
    MergeWeights(mine_both.data(), later_both.data(), share.data(), spread.data());
    for (int f = 0; f < kFeatureCount; ++f) {
        const std::size_t a = row(kFeatureMeanA + f), b = row(kFeatureMeanB + f);
        JoinMeans(mine_share_b.data(), m[a].data(), m[b].data(), mean.data());
        JoinMeans(later_share_b.data(), later[a].data(), later[b].data(), later_mean.data());
        const std::size_t m2 = row(kFeatureM2 + f);
        MergeM2(spread.data(), mean.data(), later_mean.data(), later[m2].data(), m[m2].data());
    }
    for (int half = 0; half < 2; ++half) {
        const std::size_t count = row(kCountA + half);
        MergeWeights(m[count].data(), later[count].data(), share.data(), spread.data());
        for (int c = 0; c < 3; ++c) {
            const std::size_t of_mean = row((half == 0 ? kMeanA : kMeanB) + c);
            const std::size_t m2 = row((half == 0 ? kM2A : kM2B) + c);
            Widen(m[of_mean].data(), mean.data());
            Widen(later[of_mean].data(), later_mean.data());
            MergeM2(spread.data(), mean.data(), later_mean.data(), later[m2].data(), m[m2].data());
            MergeMeans(share.data(), later[of_mean].data(), m[of_mean].data());
        }
        for (int f = 0; f < kFeatureCount; ++f) {
            const std::size_t feature = row((half == 0 ? kFeatureMeanA : kFeatureMeanB) + f);
            MergeMeans(share.data(), later[feature].data(), m[feature].data());
        }
        AddRow(later[count].data(), m[count].data());
    }
    AddRow(later[kBadCount].data(), m[kBadCount].data());
    for (std::size_t k = 0; k < kMomentsBlock; ++k) {
        m[kMaxLuminance][k] = std::max(m[kMaxLuminance][k], later[kMaxLuminance][k]);
    }
}

}  // namespace relume
