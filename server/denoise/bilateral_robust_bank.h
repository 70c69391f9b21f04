#pragma once

#include <array>
#include <vector>

#include "core/base/cancel_token.h"
#include "server/denoise/bilateral_bank.h"

namespace relume::denoise {

// The robust mode's candidates: kCandidates windows by features alone, then the same with the
// range factor.
inline constexpr int kRobustCandidates = 2 * kCandidates;

struct RobustCandidate {
    std::array<Plane, 3> filtered;
    std::array<Plane, 3> own;  // derivative of a filtered pixel by the noisy one
    Plane sure;  // unbiased estimate of the squared error a pixel, weighted by importance()
};

// Some rows of the candidates: a whole frame's would be 100 planes.
class RobustBank {
  public:
    RobustBank(const Frame& frame, const BilateralKernels& kernels, const CancelToken& cancel);

    // Adds the rows from end() on, up to `until`.
    void Extend(int until, const CancelToken& cancel);
    // Forgets the rows before `row`.
    void Drop(int row);

    int begin() const { return begin_; }
    int end() const { return end_; }
    // Planes of width x (end() - begin()).
    const RobustCandidate& operator[](int k) const {
        return candidates_[static_cast<std::size_t>(k)];
    }
    // What a squared error counts in each channel: 1/(3 (F^2 + 0.01)), F of the widest window by
    // features alone, in which a bright pixel's noise is lost. Planes of the frame's size, filled
    // before end().
    const std::array<Plane, 3>& importance() const { return importance_; }
    const std::string& features() const { return guides_.names; }  // that took part

  private:
    void FinishTile(const TileArea& tile, const float* sums);

    const Frame& frame_;
    const BilateralKernels& kernels_;
    Guides guides_;
    BankTables tables_;
    FilteredColors guide_;
    std::array<Plane, 3> importance_;  // what squared errors count
    int begin_ = 0, end_ = 0;
    std::array<RobustCandidate, kRobustCandidates> candidates_;
};

}  // namespace relume::denoise
