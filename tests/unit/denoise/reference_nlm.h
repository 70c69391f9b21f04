#pragma once

#include <functional>
#include <memory>

#include "server/denoise/denoiser.h"
#include "server/denoise/nlm_weights.h"

namespace relume::denoise {

// The definition of NlmOptions pair by pair in double, one pixel at a time.
class ReferenceNlm {
  public:
    ReferenceNlm(const NlmGuide& guide, const NlmOptions& options)
        : guide_(guide), options_(options) {}

    // Patch distance of pixel (x, y) to its neighbour at (dx, dy); kNlmOutside if there is none.
    double Distance(int x, int y, int dx, int dy) const;
    // To the mean of the neighbours at +-(dx, dy), all of which must be inside.
    double Between(int x, int y, int dx, int dy) const { return PatchDistance(x, y, dx, dy, true); }
    // Its weight, with all that the options ask for.
    double Weight(int x, int y, int dx, int dy) const;
    // Mean of `plane` by the weights over the window.
    double Filter(const Plane& plane, int radius, int x, int y) const;

  private:
    bool Inside(int x, int y) const {
        return x >= 0 && y >= 0 && x < guide_.width && y < guide_.height;
    }
    double PatchDistance(int x, int y, int dx, int dy, bool between) const;
    double PairWeight(int x, int y, int dx, int dy) const;

    const NlmGuide& guide_;
    NlmOptions options_;
};

// That what `make` makes gives the same image, error and plan by all kernels that this processor
// has, with one thread and with four.
void ExpectSameBits(const Frame& frame,
                    const std::function<std::unique_ptr<Denoiser>(const NlmKernels&)>& make);

}  // namespace relume::denoise
