#pragma once

#include <array>

#include "core/base/cancel_token.h"
#include "server/denoise/bilateral_kernels.h"
#include "server/denoise/bilateral_tiles.h"
#include "server/denoise/frame.h"

namespace relume::denoise {

// The seven cross-bilateral filters of the corrected mode side by side: features only, no range
// term.
struct CandidateBank {
    Plane filtered[kCandidates][3];
    Plane sure[kCandidates];  // unbiased estimate of the squared error a pixel, mean over RGB
                              // (methods 1.5)
    Plane self[kCandidates];  // a pixel's own share of its filtered value, in [0, 1]
    std::string features;     // that took part
};

// The bank's constants, and guides whose variance is in units of the tables' floor.
BankTables MakeBankTables();
// With wide windows made thin: of what lies farther than 10.5 pixels every other pixel counts for
// two, farther than 13.5 every fourth for four, farther than 16.5 none.
BankTables MakeThinBankTables();
Guides MakeBankGuides(const Frame& frame);

// Loads what the bank's kernels see of a tile: colours, guides and their variances.
void LoadBankPlanes(const Frame& frame, const Guides& guides, const TileArea& tile,
                    TilePlanes* scratch);

// The colours filtered by the smallest window (features alone), and what noise that leaves.
struct FilteredColors {
    std::array<Plane, 3> color, variance;
    Plane share;  // a pixel's own
};
FilteredColors FilterBySmallest(const Frame& frame, const Guides& guides, const BankTables& tables,
                                const BilateralKernels& kernels, const CancelToken& cancel);

// sigma_s of candidate k in pixels: 2^(k/2).
float CandidateSigma(int k);

CandidateBank ComputeBank(const Frame& frame, const BilateralKernels& kernels,
                          const CancelToken& cancel);

}  // namespace relume::denoise
