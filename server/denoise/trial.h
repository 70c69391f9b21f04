#pragma once

#include <algorithm>
#include <array>
#include <span>
#include <vector>

#include "core/base/cancel_token.h"
#include "server/denoise/denoiser.h"
#include "server/denoise/frame.h"
#include "server/denoise/frame_parts.h"
#include "server/denoise/halves.h"

namespace relume::denoise {

// Filters tried on parts of a frame, a sixteenth of it: both halves of each, filtered apart. The
// frame must have halves, and the filters must do without. A small frame is one part.
class Trial {
  public:
    explicit Trial(const Frame& frame);

    struct Run {
        std::vector<FilteredHalves> windows;
        double seconds = 0;  // expected for the whole frame, by the time that the parts took
    };
    Run Filter(const Denoiser& denoiser, const CancelToken& cancel) const;

    struct Window {
        FramePart part;              // of which `inner` is judged: the rest is halo
        std::array<Plane, 3> noise;  // variance of the mean
    };
    const std::vector<Window>& windows() const { return windows_; }
    bool tries_all() const { return windows_.size() == 1; }  // without halo

    // Whether halves have enough samples to say how filters compare on twice as many.
    bool tells() const;

  private:
    double whole_over_part_ = 1;
    double samples_ = 0;  // mean of a pixel; 0: not known
    std::vector<Window> windows_;
};

// Runs of a trial judged by held-out samples: what a filter makes of one half is compared with the
// other half (halves.h). Errors are relative to the brightness of the mean of some of the runs: a
// single one would be judged mildly where it is too bright itself.
class Judge {
  public:
    Judge(const Trial& trial, std::span<const Trial::Run* const> runs);

    // Estimated relative squared errors of blocks of pixels of what the filter makes of the whole
    // frame, in one order; single ones may be negative.
    using Errors = std::vector<double>;
    Errors OfNone() const;
    Errors Of(const Trial::Run& run) const;

    // The best weighted mean of some runs whose values were drawn together (blend.h), and its
    // errors. Weights are tenths, none 0, and equal unless others are better by more than one
    // standard error, or the trial does not tell.
    struct Mean {
        std::vector<int> weights;
        Errors errors;
    };
    Mean BestMean(std::span<const Trial::Run* const> runs) const;

    // Mean of `a` minus mean of `b`, and the standard error of that. Of the blocks' differences the
    // largest fiftieth is cut off, so that no firefly decides.
    struct Difference {
        double mean, error;
        double of;  // the mean of `b`, nothing cut off
        // `a` is as good as `b`: worse by less than can be told, and by less than `most` of it.
        bool Holds(double most) const { return mean <= std::min(error, std::max(0.0, most * of)); }
    };
    static Difference Compare(const Errors& a, const Errors& b);
    // Mean of `a` over mean of `b`, and the standard error of that: of all blocks, nothing cut off.
    // 1 and 0 if one of the means is not above 0.
    struct Ratio {
        double ratio, error;
    };
    static Ratio Divide(const Errors& a, const Errors& b);

  private:
    // Calls body(window, block) with each block of pixels that is judged.
    template <class Body>
    void EachBlock(Body body) const;
    // Estimated product of the errors of two runs, whose values of a pixel's halves are given.
    float Product(std::size_t window, std::size_t channel, std::size_t pixel,
                  std::array<float, 2> f, std::array<float, 2> g) const;

    const Trial& trial_;
    std::vector<std::array<Plane, 3>> scale_;  // of squared errors: 1 / (3 (brightness^2 + 0.01))
};

}  // namespace relume::denoise
