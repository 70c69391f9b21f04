#include "server/denoise/bilateral_robust_bank.h"

#include <algorithm>

#include "core/base/clones.h"
#include "server/denoise/planes.h"

namespace relume::denoise {
namespace {

constexpr float kImportanceFloor = 0.01f;  // that of RelMSE

// Rows of a tile, from sums of weights and of weighted differences: what squared errors count,
RELUME_CLONES void WeighErrors(int width, const float* __restrict weight,
                               const float* __restrict delta, const float* __restrict color,
                               float* __restrict importance) {
    for (int x = 0; x < width; ++x) {
        const float value = color[x] + delta[x] / (1 + weight[x]);
        importance[x] = 1 / (3 * (value * value + kImportanceFloor));
    }
}

// the derivative where weights don't depend on the noise,
RELUME_CLONES void Derive(int width, const float* __restrict weight, float* __restrict own) {
    for (int x = 0; x < width; ++x) {
        own[x] = 1 / (1 + weight[x]);
    }
}

// and where they do,
RELUME_CLONES void DeriveRanged(int width, const float* __restrict weight,
                                const float* __restrict delta, const float* __restrict slope,
                                const float* __restrict curve, const float* __restrict share,
                                float* __restrict own) {
    for (int x = 0; x < width; ++x) {
        const float inverse = 1 / (1 + weight[x]);
        own[x] =
            inverse * (1 + (2.0f / 3.0f) * share[x] * (curve[x] - delta[x] * inverse * slope[x]));
    }
}

// the filtered colour, and what it adds to SURE.
RELUME_CLONES void FinishChannel(int width, const float* __restrict weight,
                                 const float* __restrict delta, const float* __restrict own,
                                 const float* __restrict color, const float* __restrict variance,
                                 const float* __restrict importance, float* __restrict filtered,
                                 float* __restrict sure) {
    for (int x = 0; x < width; ++x) {
        const float change = delta[x] * (1 / (1 + weight[x]));
        filtered[x] = color[x] + change;
        sure[x] += importance[x] * (change * change + variance[x] * (2 * own[x] - 1));
    }
}

template <typename Fn>
void ForEachPlane(RobustCandidate* candidate, const Fn& fn) {
    for (std::size_t c = 0; c < 3; ++c) {
        fn(candidate->filtered[c]);
        fn(candidate->own[c]);
    }
    fn(candidate->sure);
}

}  // namespace

RobustBank::RobustBank(const Frame& frame, const BilateralKernels& kernels,
                       const CancelToken& cancel)
    : frame_(frame),
      kernels_(kernels),
      guides_(MakeBankGuides(frame)),
      tables_(MakeThinBankTables()),
      guide_(FilterBySmallest(frame, guides_, tables_, kernels, cancel)) {
    for (Plane& plane : importance_) {
        plane.resize(frame.pixel_count());
    }
}

void RobustBank::Drop(int row) {
    const auto count = static_cast<std::ptrdiff_t>(row - begin_) * frame_.width;
    for (RobustCandidate& candidate : candidates_) {
        ForEachPlane(&candidate, [&](Plane& p) { p.erase(p.begin(), p.begin() + count); });
    }
    begin_ = row;
}

void RobustBank::Extend(int until, const CancelToken& cancel) {
    const RowRange rows{end_, until};
    end_ = until;
    const auto pixels = static_cast<std::size_t>(end_ - begin_) * frame_.width;
    for (RobustCandidate& candidate : candidates_) {
        ForEachPlane(&candidate, [&](Plane& p) { p.resize(pixels); });
    }
    ForEachTile(frame_, rows, kRobustPlanes, kPairTile, cancel,
                [&](const TileArea& tile, TilePlanes& planes) {
                    LoadBankPlanes(frame_, guides_, tile, &planes);
                    const auto load = [&](int index, const Plane& plane) {
                        planes.Load(index, plane, frame_.width, frame_.height, tile.x0, tile.y0, 0);
                    };
                    for (int c = 0; c < 3; ++c) {
                        load(kRobustGuide + c, guide_.color[static_cast<std::size_t>(c)]);
                        load(kRobustNoise + c, guide_.variance[static_cast<std::size_t>(c)]);
                    }
                    load(kRobustShare, guide_.share);
                    AlignedFloats scratch = AlignedFloats::Raw(2 * kPairScratch + kRobustScratch);
                    AlignedFloats sums =
                        AlignedFloats::Raw(static_cast<std::size_t>(RobustSum(kPairHeight, 0, 0)));
                    kernels_.robust(planes.planes()[0], tables_, tile.width, tile.height,
                                    scratch.data(), sums.data());
                    FinishTile(tile, sums.data());
                });
}

// With W the sum of weights, 1 for the pixel itself: F = y + sum(w u)/W, and by the quotient rule
// dF/dy = (1 + sum over j of dw_j/dy (y_j - F))/W, where y_j - F = u + (y - F) and
// dw_j/dy = 2/3 w_j r g times the share of y in guide_i less that in guide_j.
void RobustBank::FinishTile(const TileArea& tile, const float* sums) {
    for (int y = 0; y < tile.height; ++y) {
        const auto i = static_cast<std::size_t>(tile.y0 + y) * frame_.width + tile.x0;
        const auto o = i - static_cast<std::size_t>(begin_) * frame_.width;
        const float* widest = sums + RobustSum(y, kCandidates - 1, 0);
        for (std::size_t c = 0; c < 3; ++c) {
            WeighErrors(tile.width, widest, widest + (kRobustDelta + c) * kPairWidth,
                        frame_.color[c].data() + i, importance_[c].data() + i);
        }
        for (int k = 0; k < kRobustCandidates; ++k) {
            RobustCandidate& to = candidates_[static_cast<std::size_t>(k)];
            const bool ranged = k >= kCandidates;
            const float* from = sums + RobustSum(y, k % kCandidates, 0);
            const float* weight = from + (ranged ? kRangeWeight : kRobustWeight) * kPairWidth;
            std::fill_n(to.sure.data() + o, tile.width, 0.0f);
            for (std::size_t c = 0; c < 3; ++c) {
                float* own = to.own[c].data() + o;
                if (ranged) {
                    DeriveRanged(tile.width, weight, weight + (1 + c) * kPairWidth,
                                 from + (kRangeSlope + c) * kPairWidth,
                                 from + (kRangeCurve + c) * kPairWidth, guide_.share.data() + i,
                                 own);
                } else {
                    Derive(tile.width, weight, own);
                }
                FinishChannel(tile.width, weight, weight + (1 + c) * kPairWidth, own,
                              frame_.color[c].data() + i, frame_.variance[c].data() + i,
                              importance_[c].data() + i, to.filtered[c].data() + o,
                              to.sure.data() + o);
            }
        }
    }
}

}  // namespace relume::denoise
