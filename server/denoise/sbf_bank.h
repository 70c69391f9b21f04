#pragma once

#include <array>
#include <functional>
#include <string>
#include <vector>

#include "core/base/cancel_token.h"
#include "server/denoise/bilateral_tiles.h"
#include "server/denoise/frame.h"
#include "server/denoise/sbf_kernels.h"

namespace relume::denoise {

// What SBF compares pixels by, in the kernels' units. A feature that the frame lacks is 0
// everywhere and so has no say.
struct SbfGuides {
    Plane feature[kSbfFeatures], spread[kSbfFeatures];  // normal XYZ, albedo RGB, depth
    Plane gradient, gradient_spread;                    // empty: not one of the features
    std::string names;  // "normal, albedo, depth": those that the frame has
};
SbfGuides MakeSbfGuides(const Frame& frame);

// Divides a feature and its variance so that a kernel of `sigma` is exp(-d^2 / max(s, 1)).
void NormaliseSbfGuide(float sigma, Plane* feature, Plane* variance);

// The image that the candidates are judged by, and its variance: what the authors' renderer makes
// of the same samples by its pixel filter, a Gaussian of radius 2.
struct SbfTarget {
    std::array<Plane, 3> color, variance;
};
SbfTarget MakeSbfTarget(const Frame& frame);

struct SbfCandidate {
    std::array<Plane, 3> filtered;
    Plane own;  // a pixel's own share of its filtered value
    Plane
        risk;  // estimate of the squared error a pixel, mean over RGB, by which candidates compete
};

// The cross-bilateral filters, some rows at a time: a whole frame's would be 35 planes, or 105.
// Candidate k has window k % kCandidates; with a gradient there are three times as many
// (sbf_kernels.h).
class SbfBank {
  public:
    SbfBank(const Frame& frame, const SbfGuides& guides, const SbfTarget& target,
            const SbfKernels& kernels);

    int size() const { return static_cast<int>(candidates_.size()); }

    // Makes all rows of the frame, band by band: ready(from, to) may read the candidates' rows
    // [from - reach, to + reach) that lie in the frame.
    void ForEachBand(int reach, const CancelToken& cancel,
                     const std::function<void(int from, int to)>& ready);

    // Rows [begin(), end()) of the frame.
    int begin() const { return begin_; }
    int end() const { return end_; }
    const SbfCandidate& operator[](int k) const { return candidates_[static_cast<std::size_t>(k)]; }

    // Means of `planes`, which hold the bank's rows, over window k by features alone; of rows
    // [from, to).
    std::vector<Plane> Smooth(const std::vector<const Plane*>& planes, int k, int from, int to,
                              const CancelToken& cancel) const;
    // How far window k looks, pixels.
    int Reach(int k) const { return tables_.radius[k]; }

  private:
    void Extend(int until, const CancelToken& cancel);
    void Drop(int row);
    void LoadGuides(const TileArea& tile, TilePlanes* scratch) const;
    void FinishTile(const TileArea& tile, const float* sums);

    const Frame& frame_;
    const SbfGuides& guides_;
    const SbfTarget& target_;
    const SbfKernels& kernels_;
    BankTables tables_;
    int begin_ = 0, end_ = 0;
    std::vector<SbfCandidate> candidates_;
};

}  // namespace relume::denoise
