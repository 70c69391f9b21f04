#include "bench/truth.h"

#include <algorithm>
#include <array>
#include <span>
#include <utility>

#include "core/base/parallel.h"
#include "core/image/metrics.h"

namespace relume::bench {
namespace {

double Mean(std::span<const double> values) {
    double sum = 0;
    for (const double value : values) {
        sum += value;
    }
    return sum / static_cast<double>(values.size());
}

// Without the largest thousandth.
double TrimmedMean(std::vector<double> values) {
    std::sort(values.begin(), values.end());
    return Mean(std::span(values).first(values.size() - values.size() / 1000));
}

void FindOwnError(Truth* truth) {
    const std::size_t pixels = truth->mean.size();
    std::vector<double> errors(pixels);
    for (std::size_t i = 0; i < pixels; ++i) {
        for (int c = 0; c < 3; ++c) {
            const double r = truth->mean[i][c], e = truth->floor[i][c];
            errors[i] += e / (r * r + kMrSEEpsilon) / 3;
            truth->error.relmse +=
                e / (r * r + kRelMSEEpsilon) / (3.0 * static_cast<double>(pixels));
        }
    }
    truth->error.mrse = Mean(errors);
    truth->error.trimmed = TrimmedMean(std::move(errors));
}

}  // namespace

std::vector<Truth> FindTruths(const std::vector<SampleStore>& stores, std::size_t judged) {
    const std::size_t pixels = stores[0].window().area();
    const std::vector<Rgb> zero(pixels);
    std::vector<Truth> truths(judged, Truth{zero, zero, zero, {}});
    ParallelFor(0, pixels, 64, [&](std::size_t i0, std::size_t i1) {
        std::vector<std::array<Moments, 3>> each(stores.size());
        for (std::size_t i = i0; i < i1; ++i) {
            std::array<Moments, 3> all;
            for (std::size_t s = 0; s < stores.size(); ++s) {
                each[s] = {};
                for (std::uint32_t k = 0; k < stores[s].spp(); ++k) {
                    const Rgb radiance = stores[s].Get(i, k).radiance;
                    for (int c = 0; c < 3; ++c) {
                        each[s][static_cast<std::size_t>(c)].Add(radiance[c]);
                    }
                }
                for (std::size_t c = 0; c < 3; ++c) {
                    all[c].Merge(each[s][c]);
                }
            }
            for (std::size_t without = 0; without < judged; ++without) {
                Truth& truth = truths[without];
                for (int c = 0; c < 3; ++c) {
                    const auto k = static_cast<std::size_t>(c);
                    Moments means;
                    for (std::size_t s = 0; s < stores.size(); ++s) {
                        if (s != without) {
                            means.Add(each[s][k].mean);
                        }
                    }
                    truth.mean[i][c] = static_cast<float>(means.mean);
                    truth.floor[i][c] = static_cast<float>(means.MeanVariance());
                    truth.variance[i][c] = static_cast<float>(all[k].SampleVariance());
                }
            }
        }
    });
    for (Truth& truth : truths) {
        FindOwnError(&truth);
    }
    return truths;
}

Score Compare(const Truth& truth, const std::function<double(std::size_t pixel, int c)>& value) {
    std::vector<double> errors(truth.mean.size());
    double sum = 0, reference = 0;
    Score score;
    for (std::size_t i = 0; i < errors.size(); ++i) {
        for (int c = 0; c < 3; ++c) {
            const double r = truth.mean[i][c], x = value(i, c),
                         e = (x - r) * (x - r) - truth.floor[i][c];
            errors[i] += e / (r * r + kMrSEEpsilon) / 3;
            score.relmse += e / (r * r + kRelMSEEpsilon) / 3;
            sum += x;
            reference += r;
        }
    }
    const auto n = static_cast<double>(errors.size());
    score.relmse /= n;
    score.mrse = Mean(errors);
    score.trimmed = TrimmedMean(std::move(errors));
    score.energy = reference > 0 ? sum / reference : 1;
    return score;
}

}  // namespace relume::bench
