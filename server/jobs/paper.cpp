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
// s^2/n over all samples.
//
// corrected restores the factor (c-f)^2, divides by f^2 + 1e-3 and uses all four thresholds.
// Samples are of low discrepancy, for which s^2/n overestimates; Var is therefore regularised:
// s^2/n scaled to the level of the halves' differences in 21x21 pixels (methods 1.2, estimator 3).
// Its documented failure stays: a pixel that saw nothing (c = f, no variance) stops for ever, so
// that rare light comes out dark.
//
// A pass that would exceed the budget is scaled down to it, all pixels alike: D is too noisy a
// reading to choose by its size. A pixel whose newest samples were all bad (NaN) stops, so that it
// can't keep a job alive.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/base/parallel.h"
#include "core/base/param_set.h"
#include "server/jobs/paper_rule.h"
#include "server/jobs/planner.h"
#include "server/jobs/spread.h"

namespace relume::jobs {
namespace {

constexpr std::size_t kGrain = 4096;  // pixels a task
constexpr std::size_t kBox = 21;      // pixels a side; a multiple of 3
constexpr std::size_t kRadius = kBox / 2;

// Sums of kBox neighbours: out[i] = in[i] + ... + in[i + kBox - 1], each a row of `width` values,
// by way of sums of three, which are left in `in`. No running sums: what a firefly adds to one and
// takes out again would leave a trace. `in` has `count` + kBox - 1 rows.
void BoxSums(std::size_t count, std::size_t width, std::vector<double>* in,
             std::vector<double>* out) {
    double* t = in->data();
    for (std::size_t i = 0; i < (count + kBox - 3) * width; ++i) {
        t[i] += t[i + width] + t[i + 2 * width];
    }
    std::fill(out->begin(), out->end(), 0.0);
    for (std::size_t offset = 0; offset < kBox; offset += 3) {
        for (std::size_t i = 0; i < count * width; ++i) {
            (*out)[i] += t[i + offset * width];
        }
    }
}

// Mean over kBox x kBox pixels, clipped at the border.
std::vector<float> BoxMean(const std::vector<float>& plane, int width, int height) {
    const auto w = static_cast<std::size_t>(width), h = static_cast<std::size_t>(height);
    // Pixels of a line of `size` that the box at `i` covers.
    const auto covered = [](std::size_t i, std::size_t size) {
        return std::min(size - 1, i + kRadius) - (i - std::min(i, kRadius)) + 1;
    };
    std::vector<double> rows(plane.size());
    ParallelFor(0, h, 16, [&](std::size_t y0, std::size_t y1) {
        std::vector<double> padded, sums(w);
        for (std::size_t y = y0; y < y1; ++y) {
            padded.assign(w + kBox - 1, 0.0);
            std::copy_n(plane.begin() + static_cast<std::ptrdiff_t>(y * w), w,
                        padded.begin() + kRadius);
            BoxSums(w, 1, &padded, &sums);
            std::copy(sums.begin(), sums.end(), rows.begin() + static_cast<std::ptrdiff_t>(y * w));
        }
    });
    std::vector<float> mean(plane.size());
    ParallelFor(0, w, 32, [&](std::size_t x0, std::size_t x1) {
        const std::size_t strip = x1 - x0;
        std::vector<double> padded((h + kBox - 1) * strip, 0.0), sums(h * strip);
        for (std::size_t y = 0; y < h; ++y) {
            std::copy_n(rows.begin() + static_cast<std::ptrdiff_t>(y * w + x0), strip,
                        padded.begin() + static_cast<std::ptrdiff_t>((y + kRadius) * strip));
        }
        BoxSums(h, strip, &padded, &sums);
        for (std::size_t y = 0; y < h; ++y) {
            for (std::size_t k = 0; k < strip; ++k) {
                const auto pixels = static_cast<double>(covered(x0 + k, w) * covered(y, h));
                mean[y * w + x0 + k] = static_cast<float>(sums[y * strip + k] / pixels);
            }
        }
    });
    return mean;
}

// What s^2/n is multiplied by, per channel: the level of the halves' variance over that of the
// samples'.
std::array<std::vector<float>, 3> VarianceLevel(const Film& film) {
    std::array<std::vector<float>, 3> sample, half;
    for (std::size_t c = 0; c < 3; ++c) {
        sample[c].resize(film.pixel_count());
        half[c].resize(film.pixel_count());
    }
    ParallelFor(0, film.pixel_count(), kGrain, [&](std::size_t i0, std::size_t i1) {
        for (std::size_t i = i0; i < i1; ++i) {
            const Rgb s = film.MeanVariance(i), d = film.HalfVariance(i);
            for (std::size_t c = 0; c < 3; ++c) {
                sample[c][i] = s[static_cast<int>(c)];
                half[c][i] = d[static_cast<int>(c)];
            }
        }
    });
    for (std::size_t c = 0; c < 3; ++c) {
        sample[c] = BoxMean(sample[c], film.width(), film.height());
        half[c] = BoxMean(half[c], film.width(), film.height());
        for (std::size_t i = 0; i < half[c].size(); ++i) {
            half[c][i] /= 1e-10f + sample[c][i];
        }
    }
    return half;
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
        ScaleDown(budget, &plan.counts);
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
                PixelEstimate now{film.Mean(i),
                                  corrected ? film.MeanVariance(i) : SampleVariance(film, i),
                                  film.SampleCount(i)};
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

    // s^2/n over the samples of both halves.
    static Rgb SampleVariance(const Film& film, std::size_t i) {
        const float a = film.Plane(kCountA)[i], b = film.Plane(kCountB)[i], n = a + b;
        Rgb variance;
        for (int c = 0; c < 3 && n > 1; ++c) {
            const float between = film.Plane(kMeanB + c)[i] - film.Plane(kMeanA + c)[i];
            const float m2 = film.Plane(kM2A + c)[i] + film.Plane(kM2B + c)[i] +
                             (a > 0 && b > 0 ? between * between * a * b / n : 0);
            variance[c] = m2 / (n * (n - 1));
        }
        return variance;
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
