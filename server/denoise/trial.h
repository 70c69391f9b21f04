#pragma once

#include <array>
#include <vector>

#include "core/base/cancel_token.h"
#include "server/denoise/denoiser.h"
#include "server/denoise/frame.h"
#include "server/denoise/frame_parts.h"

namespace relume::denoise {

// Filters judged on parts of a frame, a sixteenth of it, by held-out samples: what a filter makes
// of one half is compared with the other half (halves.h). The frame must have halves.
class Trial {
  public:
    // The parts: windows spread over the frame, the same for each filter. A small frame is one
    // window. Errors are relative to the brightness of what `base` makes of it.
    Trial(const Frame& frame, const Denoiser& base, const CancelToken& cancel);

    // Estimated relative squared errors of blocks of pixels, in one order; single ones may be
    // negative.
    using Errors = std::vector<double>;

    // Of the frame as it is.
    const Errors& unfiltered() const { return unfiltered_; }
    const Errors& base() const { return base_; }
    double base_seconds() const { return base_seconds_; }  // expected for the whole frame

    // Of what the filter makes of the whole frame. `seconds`: expected for that. The filter must do
    // without halves.
    Errors Judge(const Denoiser& denoiser, const CancelToken& cancel, double* seconds) const;

    // Mean of `a` minus mean of `b`, and the standard error of that. Blocks are cut off where
    // `base` has its largest ones, so that no firefly decides.
    struct Difference {
        double mean, error;
        bool Holds() const { return mean <= error; }  // `a` is as good as `b`
    };
    Difference Compare(const Errors& a, const Errors& b) const;
    double Mean(const Errors& errors) const;

  private:
    struct Window {
        FramePart part;
        TileRect innerX;             // judged: the rest is halo
        std::array<Plane, 3> scale;  // of squared errors: 1 / (3 (brightness^2 + 0.01))
        std::array<Plane, 3> noise;  // variance of the mean
    };
    void AddBlocks(const Window& window, const std::array<Plane, 3>& squared, Errors* errors) const;

    double whole_over_part_ = 1;
    double largest_ = 0;  // that a block counts
    std::vector<Window> windows_;
    Errors unfiltered_, base_;
    double base_seconds_ = 0;
};

}  // namespace relume::denoise
