// The adaptive sampler of Xing, Chen, Li 2020 (equations 1 to 6; methods 3.1, 3.9).
//
//   mode    printed or corrected (default)
//   alpha   increments of equation (6): 1-2-4-8 (default) or 1-4-16-32
//   pilot   samples a pixel in the first pass, in halves of half of them; even (default 4)
//   passes  most passes (default 256): a few pixels with fireflies would otherwise go on by ones
//   and tens
//
// After each pass a pixel that got samples compares its last value c (s_c samples) with its new one
// f (s_f): D of equation (5) sets its next increment by (6). A pixel without new samples keeps its
// D, so that stopping is for good. After the pilot there is no last value: c is the half of even
// samples, f all of them.
//
// printed takes (5) literally, D = k + Var[c] - Var[f] with k > 1. That is trivial: D is above Phi3
// for every pixel whose variance did not just jump by more than k, so that all get alpha4 in every
// pass: uniform sampling in steps of 8, but for pixels hit by a firefly, which stop bright. Var is
// s^2/n.
//
// corrected restores the factor (c-f)^2, divides by f^2 + 1e-3 and uses all four thresholds.
// Samples are of low discrepancy, for which s^2/n overestimates; Var is therefore regularised:
// s^2/n scaled to the level of the halves' differences in 21x21 pixels (methods 1.2, estimator 3).
// Its documented failure stays: a pixel that saw nothing (c = f, no variance) stops for ever, so
// that rare light comes out dark.
//
// A pass that would exceed the budget serves the largest D first (ties: lower index). A pixel whose
// newest samples were all bad (NaN) stops, so that it can't keep a job alive.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/base/error.h"
#include "core/base/parallel.h"
#include "core/base/param_set.h"
#include "server/jobs/paper_rule.h"
#include "server/jobs/planner.h"
#include "server/jobs/spread.h"

namespace relume::jobs {
namespace {

constexpr std::size_t kGrain = 4096;  // pixels a task
constexpr int kBoxRadius = 10;        // 21 x 21

// Mean over (2r+1)^2 pixels, clipped at the border.
std::vector<float> BoxMean(const std::vector<float>& plane, int width, int height) {
    std::vector<double> rows(plane.size());
    std::vector<float> mean(plane.size());
    const auto w = static_cast<std::size_t>(width);
    ParallelFor(0, static_cast<std::size_t>(height), 8, [&](std::size_t y0, std::size_t y1) {
        for (std::size_t y = y0; y < y1; ++y) {
            for (int x = 0; x < width; ++x) {
                double sum = 0;
                for (int u = std::max(0, x - kBoxRadius); u <= std::min(width - 1, x + kBoxRadius);
                     ++u) {
                    sum += plane[y * w + static_cast<std::size_t>(u)];
                }
                rows[y * w + static_cast<std::size_t>(x)] = sum;
            }
        }
    });
    ParallelFor(0, static_cast<std::size_t>(height), 8, [&](std::size_t y0, std::size_t y1) {
        std::vector<double> sums(w);
        for (std::size_t y = y0; y < y1; ++y) {
            const int top = std::max(0, static_cast<int>(y) - kBoxRadius);
            const int bottom = std::min(height - 1, static_cast<int>(y) + kBoxRadius);
            std::fill(sums.begin(), sums.end(), 0.0);
            for (int v = top; v <= bottom; ++v) {
                const double* row = rows.data() + static_cast<std::size_t>(v) * w;
                for (std::size_t x = 0; x < w; ++x) {
                    sums[x] += row[x];
                }
            }
            for (int x = 0; x < width; ++x) {
                const int across =
                    std::min(width - 1, x + kBoxRadius) - std::max(0, x - kBoxRadius) + 1;
                mean[y * w + static_cast<std::size_t>(x)] =
                    static_cast<float>(sums[static_cast<std::size_t>(x)] /
                                       (static_cast<double>(across) * (bottom - top + 1)));
            }
        }
    });
    return mean;
}

// What s^2/n is multiplied by, per channel: the level of the halves' variance over that of the
// samples'.
std::array<std::vector<float>, 3> VarianceLevel(const Film& film) {
    std::array<std::vector<float>, 3> level;
    for (std::size_t c = 0; c < 3; ++c) {
        std::vector<float> sample(film.pixel_count()), half(film.pixel_count());
        ParallelFor(0, film.pixel_count(), kGrain, [&](std::size_t i0, std::size_t i1) {
            for (std::size_t i = i0; i < i1; ++i) {
                sample[i] = film.MeanVariance(i)[static_cast<int>(c)];
                half[i] = film.HalfVariance(i)[static_cast<int>(c)];
            }
        });
        sample = BoxMean(sample, film.width(), film.height());
        level[c] = BoxMean(half, film.width(), film.height());
        for (std::size_t i = 0; i < level[c].size(); ++i) {
            level[c][i] /= 1e-10f + sample[i];
        }
    }
    return level;
}

class Paper final : public Planner {
  public:
    explicit Paper(const ParamSet& params)
        : mode_(params.GetChoice("mode", "corrected", {"printed", "corrected"})),
          alpha_name_(params.GetChoice("alpha", "1-2-4-8", {"1-2-4-8", "1-4-16-32"})),
          pilot_(params.GetInt("pilot", 4)),
          passes_(params.GetInt("passes", 256)) {
        if (pilot_ < 4 || pilot_ > 4096 || pilot_ % 2 != 0) {
            ThrowInvalidArgument(
                fmt::format("sampler 'paper': pilot={} must be even and 4 to 4096", pilot_));
        }
        if (passes_ < 1 || passes_ > 10'000) {
            ThrowInvalidArgument(
                fmt::format("sampler 'paper': passes={} must be 1 to 10000", passes_));
        }
        if (alpha_name_ == "1-4-16-32") {
            alpha_ = {1, 4, 16, 32};
        }
    }

    std::string Describe() const override {
        return fmt::format("paper:mode={},alpha={},pilot={},passes={}", mode_, alpha_name_, pilot_,
                           passes_);
    }

    Plan NextPass(const Film& film, std::uint64_t budget) override {
        if (budget == 0) {
            return {{}, kBudgetSpent};
        }
        if (pass_ == passes_) {
            return {{}, fmt::format("pass limit of {} reached", passes_)};
        }
        if (pass_++ == 0) {
            return {SpreadPilot(film.pixel_count(), static_cast<std::uint32_t>(pilot_), budget),
                    {}};
        }
        UpdateGains(film);
        Plan plan;
        plan.counts.resize(film.pixel_count());
        std::uint64_t total = 0;
        for (std::size_t i = 0; i < gain_.size(); ++i) {
            plan.counts[i] = mode_ == "printed" ? PrintedIncrement(gain_[i], alpha_)
                                                : CorrectedIncrement(gain_[i], alpha_);
            total += plan.counts[i];
        }
        if (total == 0) {
            return {{}, "selector negative everywhere"};
        }
        if (total > budget) {
            CutToBudget(budget, &plan.counts);
        }
        return plan;
    }

  private:
    // D of every pixel that got samples since the last call; what it has now becomes its last
    // value.
    void UpdateGains(const Film& film) {
        const std::size_t pixels = film.pixel_count();
        const bool first = last_.empty();
        if (first) {
            last_.resize(pixels);
            asked_.assign(pixels, 0);
            gain_.assign(pixels, 0);
        }
        const bool corrected = mode_ == "corrected";
        const auto level = corrected ? VarianceLevel(film) : std::array<std::vector<float>, 3>{};
        ParallelFor(0, pixels, kGrain, [&](std::size_t i0, std::size_t i1) {
            for (std::size_t i = i0; i < i1; ++i) {
                const std::uint32_t asked = film.NextIndex(i);
                if (asked == asked_[i]) {
                    continue;
                }
                asked_[i] = asked;
                PixelEstimate now{film.Mean(i), film.MeanVariance(i), film.SampleCount(i)};
                PixelEstimate before = first ? EvenHalf(film, i) : last_[i];
                for (int c = 0; corrected && c < 3; ++c) {
                    const float scale = level[static_cast<std::size_t>(c)][i];
                    now.variance[c] *= scale;
                    if (first) {
                        before.variance[c] *= scale;
                    }
                }
                gain_[i] = Gain(before, now);
                last_[i] = now;
            }
        });
    }

    static PixelEstimate EvenHalf(const Film& film, std::size_t i) {
        PixelEstimate half;
        half.n = film.Plane(kCountA)[i];
        for (int c = 0; c < 3; ++c) {
            half.mean[c] = film.Plane(kMeanA + c)[i];
            half.variance[c] = half.n > 1 ? film.Plane(kM2A + c)[i] / (half.n * (half.n - 1)) : 0;
        }
        return half;
    }

    float Gain(const PixelEstimate& before, const PixelEstimate& now) const {
        if (now.n <= before.n) {
            return 0;  // nothing but bad samples
        }
        if (before.n == 0) {
            return static_cast<float>(2 * kPhi[3]);  // nothing to compare with: go on once more
        }
        const double gain =
            mode_ == "printed" ? PrintedGain(before, now) : CorrectedGain(before, now);
        return std::isnan(gain) ? static_cast<float>(2 * kPhi[3]) : static_cast<float>(gain);
    }

    void CutToBudget(std::uint64_t budget, std::vector<std::uint32_t>* counts) const {
        std::vector<std::uint32_t> order(counts->size());
        std::iota(order.begin(), order.end(), 0u);
        std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
            return gain_[a] != gain_[b] ? gain_[a] > gain_[b] : a < b;
        });
        for (const std::uint32_t i : order) {
            (*counts)[i] =
                static_cast<std::uint32_t>(std::min<std::uint64_t>((*counts)[i], budget));
            budget -= (*counts)[i];
        }
    }

    std::string mode_, alpha_name_;
    int pilot_, passes_;
    std::array<std::uint32_t, 4> alpha_{1, 2, 4, 8};

    int pass_ = 0;                      // passes planned so far
    std::vector<PixelEstimate> last_;   // f of the pixel's last D; its next c
    std::vector<std::uint32_t> asked_;  // samples it had then, bad ones included
    std::vector<float> gain_;           // D
};

}  // namespace

std::unique_ptr<Planner> MakePaper(const ParamSet& params) {
    return std::make_unique<Paper>(params);
}

}  // namespace relume::jobs
