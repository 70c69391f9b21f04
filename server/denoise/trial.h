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
#include "server/denoise/net_inputs.h"

namespace relume::denoise {

// Filters tried on parts of a frame, a sixteenth of it, or of a small one up to a half: on one half
// of the samples there. The frame must have halves, and the filters must do without. A very small
// frame is one part.
class Trial {
  public:
    explicit Trial(const Frame& frame);

    struct Run {
        std::vector<std::vector<Result>> halves;  // filtered: one or two, a window each
        double seconds = 0;  // expected for the whole frame, by the time that the parts took
    };
    // `halves`: 1, the first alone, or 2.
    Run Filter(const Denoiser& denoiser, int halves, const CancelToken& cancel) const;
    // The same of both halves of the whole frame, of which the windows are cut.
    struct Whole {
        Run run;
        FilteredHalves halves;
    };
    Whole FilterWhole(const Denoiser& denoiser, const Frame& frame,
                      const CancelToken& cancel) const;
    // Errors of what a run of both halves made of the windows of a large frame, of which those are
    // that its estimate looks at.
    std::vector<WindowError> JudgeWindows(const Run& run) const;
    // What the network of `net` makes of runs, by their number in kNetSlots; null: not there. The
    // noisy candidate needs none. Its time is that of the network alone.
    Run Mix(const std::array<const Run*, kNetSlotCount>& runs, int halves,
            const CancelToken& cancel) const;

    struct Window {
        FramePart part;                     // of which `inner` is judged: the rest is halo
        std::array<Frame, 2> half;          // frames of their own
        std::array<Plane, 3> noise;         // variance of the mean
        std::vector<unsigned char> lights;  // FindSeenLights: no filter is to change them
    };
    const std::vector<Window>& windows() const { return windows_; }
    // Pixels that a filter sees, over those of the frame.
    double share() const { return 1 / whole_over_part_; }

    // Estimates of its error look at the whole of such a frame (error_estimate.h).
    bool is_small() const { return is_small_; }

    double samples() const { return samples_; }  // mean of a pixel; 0: not known
    // Whether a half has enough of them to say how filters compare on twice as many.
    bool tells() const;
    // Whether its parts are enough of a picture to choose a filter for the whole by. One window of
    // a small frame may be wall alone.
    bool is_wide() const;

  private:
    // make(half, window) for each, timed.
    template <class Make>
    Run RunEach(int halves, Make make) const;

    double whole_over_part_ = 1;
    double samples_ = 0;
    bool is_small_ = false;
    std::vector<Window> windows_;
};

// Runs of a trial judged by held-out samples: what a filter made of one half is compared with the
// other (halves.h). Of runs of one half the noise is the same, and cancels where two are compared;
// what is left of it in an error itself is lowered by one filter, the base, tried on both.
//
// Errors are relative to the brightness of the mean of some of the runs: a single one would be
// judged mildly where it is too bright itself.
class Judge {
  public:
    // The first of the runs is the base's, of both halves; the others are of as many as is said.
    Judge(const Trial& trial, std::span<const Trial::Run* const> runs, int halves);

    // Estimated relative squared errors of blocks of pixels of what the filter makes of the whole
    // frame, in one order; single ones may be negative.
    using Errors = std::vector<double>;
    Errors OfNone() const;
    Errors Of(const Trial::Run& run) const;

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
    // Estimated product of the errors of two runs of a half, whose values of a pixel are given.
    float Product(std::size_t window, std::size_t channel, std::size_t pixel, int half, float f,
                  float g) const;
    // Of the first `halves` of a run.
    Errors Of(const Trial::Run& run, int halves) const;

    const Trial& trial_;
    std::vector<std::array<Plane, 3>> scale_;  // of squared errors: 1 / (3 (brightness^2 + 0.01))
    int halves_;
    Errors correction_;  // of a block: the base's error by both halves, minus that by `halves_`
};

}  // namespace relume::denoise
