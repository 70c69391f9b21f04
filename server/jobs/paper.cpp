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
// The rule compares the last two states of a pixel, so that a plan needs whole passes: workers wait
// at the end of each.
//
// A pass that would exceed the budget is scaled down to it, all pixels alike: D is too noisy a
// reading to choose by its size. A pixel whose newest samples were all bad (NaN) stops, so that it
// can't keep a job alive.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/base/byte_stream.h"
#include "core/base/error.h"
#include "core/base/parallel.h"
#include "core/base/param_set.h"
#include "server/jobs/paper_rule.h"
#include "server/jobs/planner.h"
#include "server/jobs/spread.h"
#include "server/jobs/variance_level.h"

namespace relume::jobs {
namespace {

constexpr std::size_t kGrain = 4096;  // pixels a task
class Paper final : public Planner {
  public:
    explicit Paper(const ParamSet& params)
        : mode_(params.GetChoice("mode", "corrected", {"printed", "corrected"})),
          alpha_name_(params.GetChoice("alpha", "1-2-4-8", {"1-2-4-8", "1-4-16-32"})),
          pilot_(ReadPilot(params, "paper", 4, 4)),
          passes_(params.GetInt("passes", 256)) {
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

    FilmView View() const override { return FilmView::kWhole; }

    Plan NextPass(const PlanInput& input) override {
        const Film& film = input.film;
        const std::uint64_t budget = input.budget;
        if (budget == 0) {
            return {{}, kBudgetSpent, {}, {}};
        }
        if (pass_ == passes_) {
            return {{}, fmt::format("pass limit of {} reached", passes_), {}, {}};
        }
        if (pass_++ == 0) {
            return {SpreadPilot(film.pixel_count(), static_cast<std::uint32_t>(pilot_), budget),
                    {},
                    {},
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
            return {{}, "selector negative everywhere", {}, {}};
        }
        ScaleDown(budget, &plan.counts);
        return plan;
    }

    std::string Save() const override {
        ByteWriter out;
        out.Put(pass_);
        out.PutAll(last_);
        out.PutAll(asked_);
        out.PutAll(gain_);
        return out.Take();
    }
    void Restore(std::string_view bytes) override {
        ByteReader in(bytes);
        pass_ = in.Get<int>();
        last_ = in.GetAll<PixelEstimate>();
        asked_ = in.GetAll<std::uint32_t>();
        gain_ = in.GetAll<float>();
        in.End();
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
