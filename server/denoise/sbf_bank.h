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
    std::vector<Plane> feature, spread;  // normal XYZ, albedo RGB, depth
    std::string names;                   // "normal, albedo, depth": those that the frame has
};
SbfGuides MakeSbfGuides(const Frame& frame);

// Appends a feature with its variance, for a kernel of `sigma`.
void AddSbfGuide(Plane feature, Plane variance, float sigma, const char* name, SbfGuides* guides);

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

// The seven cross-bilateral filters, some rows at a time: a whole frame's would be 35 planes.
class SbfBank {
  public:
    SbfBank(const Frame& frame, const SbfGuides& guides, const SbfTarget& target,
            const SbfKernels& kernels);

    // Makes all rows of the frame, band by band: ready(from, to) may read the candidates' rows
    // [from - reach, to + reach) that lie in the frame.
    void ForEachBand(int reach, const CancelToken& cancel,
                     const std::function<void(int from, int to)>& ready);

    // Rows [begin(), end()) of the frame.
    int begin() const { return begin_; }
    int end() const { return end_; }
    const SbfCandidate& operator[](int k) const { return candidates_[static_cast<std::size_t>(k)]; }

    // Means by the feature weights and a Gaussian of `sigma` pixels, cut at 2 sigma and 16 pixels.
    // `planes`, at most kSbfSmoothed, hold the bank's rows; the result rows [from, to).
    std::vector<Plane> Smooth(const std::vector<const Plane*>& planes, float sigma, int from,
                              int to, const CancelToken& cancel) const;

  private:
    void Extend(int until, const CancelToken& cancel);
    void Drop(int row);
    void LoadGuides(const TileArea& tile, TilePlanes* scratch) const;
    void FinishTile(const TileArea& tile, const float* sums);

    const Frame& frame_;
    const SbfGuides& guides_;
    const SbfTarget& target_;
    const SbfKernels& kernels_;
    SbfTables tables_;
    int begin_ = 0, end_ = 0;
    std::array<SbfCandidate, kCandidates> candidates_;
};

// How far Smooth looks, pixels.
int SbfReach(float sigma);

}  // namespace relume::denoise
