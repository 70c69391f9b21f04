#pragma once

#include <limits>

#include "server/denoise/worth.h"

namespace relume::denoise {

// What a choice of filters has spent, in times of the bilateral filter on the frame, and what it
// may spend.
class Purse {
  public:
    // `effort`: of what the samples cost that would gain as much; 0: any. `seconds`: that all may
    // take; 0: any. `samples` a pixel are there; 0: not known. `unit`: seconds of the bilateral
    // filter on the frame; 0: not known.
    Purse(double effort, double seconds, const Sampling& sampling, double samples, double unit)
        : sampling_(sampling),
          samples_cost_(effort > 0 && samples > 0 ? effort * samples * SampleCost(sampling)
                                                  : std::numeric_limits<double>::infinity()),
          most_(seconds > 0 && unit > 0 ? seconds / unit
                                        : std::numeric_limits<double>::infinity()) {}

    void Spend(double cost) { spent_ += cost; }

    // Spends that on what lowers the error to `gain` of it, if it pays and there is as much.
    bool Buy(double cost, double gain) {
        const bool buys = gain < 1 && cost <= SamplesFor(gain, sampling_) * samples_cost_ &&
                          spent_ + cost <= most_;
        spent_ += buys ? cost : 0;
        return buys;
    }

  private:
    Sampling sampling_;
    double samples_cost_, most_, spent_ = 0;
};

}  // namespace relume::denoise
