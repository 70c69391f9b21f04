#pragma once

#include <vector>

#include "server/denoise/wlr_fit.h"

namespace relume::denoise {

// Weighted local regression of one pixel in double (methods 2.7, steps 1 to 4).
class ReferenceWlr {
  public:
    ReferenceWlr(const WlrInput& input, int radius, int x, int y);

    // Components that stand out of the noise, and how near the nearest singular value is to where
    // that is decided, as a share of it.
    int dimensions() const { return dimensions_; }
    double margin() const { return margin_; }

    struct Fit {
        double color[3], variance;
    };
    Fit FitWith(double bandwidth) const;

  private:
    static constexpr int kColumns = kWlrColumns;
    struct Neighbour {
        std::size_t pixel;
        double place[kColumns];  // along the axes
    };

    double At(int plane, std::size_t pixel) const { return input_.plane[plane][pixel]; }
    void FindCurvature();

    const WlrInput& input_;
    std::size_t pixel_;
    int dimensions_ = 2;
    double margin_ = 1e9;
    std::vector<Neighbour> neighbours_;
    double narrowness_[kColumns];
};

}  // namespace relume::denoise
