#include "server/denoise/sbf_bank.h"

#include <algorithm>
#include <cmath>

#include "server/denoise/bilateral_bank.h"
#include "server/denoise/planes.h"

namespace relume::denoise {
namespace {

// Li, Wu, Chuang 2012, section 5: sigma of normal, albedo, depth; floor of a pair's variance
// (methods 2.4).
constexpr float kFeatureSigma[3] = {0.8f, 0.25f, 0.6f};
constexpr float kVarianceFloor = 1e-2f;
constexpr int kBandRows = 2 * kPairHeight;

// What PBRT's pixel filter, exp(-2 d^2) - exp(-8) up to 2 pixels both ways, gives at each of five
// pixels to samples that lie anywhere in the middle one.
std::vector<float> PixelFilterTaps() {
    constexpr int kSteps = 64;
    std::vector<float> taps;
    for (int k = -2; k <= 2; ++k) {
        double sum = 0;
        for (int s = 0; s < kSteps; ++s) {
            const double d = k + (s + 0.5) / kSteps - 0.5;
            sum += std::max(0.0, std::exp(-2 * d * d) - std::exp(-8.0));
        }
        taps.push_back(static_cast<float>(sum / kSteps));
    }
    return taps;
}

template <typename Fn>
void ForEachPlane(SbfCandidate* candidate, const Fn& fn) {
    for (Plane& plane : candidate->filtered) {
        fn(plane);
    }
    fn(candidate->own);
    fn(candidate->risk);
}

}  // namespace

void NormaliseSbfGuide(float sigma, Plane* feature, Plane* variance) {
    const float floor = kVarianceFloor * 2 * sigma * sigma, scale = 1 / std::sqrt(floor);
    for (float& value : *feature) {
        value = std::clamp(value * scale, -kSbfLargest, kSbfLargest);
    }
    for (float& value : *variance) {
        value = std::clamp(value / kVarianceFloor, 0.0f, kSbfLargest);
    }
}

SbfGuides MakeSbfGuides(const Frame& frame) {
    SbfGuides guides;
    const std::size_t pixels = frame.pixel_count();
    int to = 0;
    const auto add = [&](int first, int count, float scale, float sigma, const char* name) {
        for (int f = first; f < first + count; ++f, ++to) {
            Plane &feature = guides.feature[to], &variance = guides.spread[to];
            feature = frame.feature[f];
            variance = frame.feature_variance[f];
            feature.resize(pixels, 0.0f);
            variance.resize(pixels, 0.0f);
            for (std::size_t i = 0; i < pixels && scale != 1; ++i) {
                feature[i] *= scale;
                variance[i] *= scale * scale;
            }
            NormaliseSbfGuide(sigma, &feature, &variance);
        }
        if (!frame.feature[first].empty()) {
            guides.names += (guides.names.empty() ? "" : ", ") + std::string(name);
        }
    };
    float farthest = 0;
    for (const float z : frame.feature[kDepth]) {
        farthest = std::max(farthest, z);
    }
    add(kNormalX, 3, 1, kFeatureSigma[0], "normal");
    add(kAlbedoR, 3, 1, kFeatureSigma[1], "albedo");
    add(kDepth, 1, farthest > 0 ? 1 / farthest : 0, kFeatureSigma[2], "depth");
    return guides;
}

SbfTarget MakeSbfTarget(const Frame& frame) {
    const std::vector<float> taps = PixelFilterTaps();
    SbfTarget target;
    for (std::size_t c = 0; c < 3; ++c) {
        target.color[c] = BlurByTaps(frame.color[c], frame.width, frame.height, taps);
        target.variance[c] = BlurByTaps(frame.variance[c], frame.width, frame.height, taps);
    }
    return target;
}

SbfBank::SbfBank(const Frame& frame, const SbfGuides& guides, const SbfTarget& target,
                 const SbfKernels& kernels)
    : frame_(frame),
      guides_(guides),
      target_(target),
      kernels_(kernels),
      tables_(MakeBankTables()),
      candidates_(static_cast<std::size_t>(kCandidates) *
                  (guides.gradient.empty() ? 1 : kSbfGradientKinds)) {}

void SbfBank::ForEachBand(int reach, const CancelToken& cancel,
                          const std::function<void(int, int)>& ready) {
    for (int done = 0; done < frame_.height;) {
        Extend(std::min(end_ + kBandRows, frame_.height), cancel);
        const int until = end_ == frame_.height ? end_ : end_ - reach;
        ready(done, until);
        done = until;
        Drop(std::max(begin_, done - reach));
    }
}

void SbfBank::Drop(int row) {
    const auto count = static_cast<std::ptrdiff_t>(row - begin_) * frame_.width;
    for (SbfCandidate& candidate : candidates_) {
        ForEachPlane(&candidate, [&](Plane& p) { p.erase(p.begin(), p.begin() + count); });
    }
    begin_ = row;
}

void SbfBank::LoadGuides(const TileArea& tile, TilePlanes* scratch) const {
    const auto load = [&](int index, const Plane& plane, float outside) {
        scratch->Load(index, plane, frame_.width, frame_.height, tile.x0, tile.y0, outside);
    };
    for (int f = 0; f < kSbfFeatures; ++f) {
        load(kSbfFeature + f, guides_.feature[f], f == 6 ? kOutside : 0);
        load(kSbfSpread + f, guides_.spread[f], 0);
    }
}

void SbfBank::Extend(int until, const CancelToken& cancel) {
    const RowRange rows{end_, until};
    end_ = until;
    const auto pixels = static_cast<std::size_t>(end_ - begin_) * frame_.width;
    for (SbfCandidate& candidate : candidates_) {
        ForEachPlane(&candidate, [&](Plane& p) { p.resize(pixels); });
    }
    const auto kinds = candidates_.size() / kCandidates;
    ForEachTile(frame_, rows, kSbfData + kSbfColors, kPairTile, cancel,
                [&](const TileArea& tile, TilePlanes& planes) {
                    LoadGuides(tile, &planes);
                    const auto load = [&](int index, const Plane& plane) {
                        planes.Load(index, plane, frame_.width, frame_.height, tile.x0, tile.y0, 0);
                    };
                    if (kinds > 1) {
                        load(kSbfGradient, guides_.gradient);
                        load(kSbfGradient + 1, guides_.gradient_spread);
                    }
                    for (int c = 0; c < kSbfColors; ++c) {
                        load(kSbfData + c, frame_.color[c]);
                    }
                    AlignedFloats scratch = AlignedFloats::Raw(kinds * kPairScratch);
                    AlignedFloats sums = AlignedFloats::Raw(
                        static_cast<std::size_t>(SbfSum(size(), kPairHeight, 0, 0)));
                    kernels_.bank(planes.planes()[0], tables_, size(), tile.height, scratch.data(),
                                  sums.data());
                    FinishTile(tile, sums.data());
                });
}

// Weights depend on features alone, so that the derivative of a pixel by its own noise is its
// weight, 1, over the sum of weights.
void SbfBank::FinishTile(const TileArea& tile, const float* sums) {
    for (int k = 0; k < size(); ++k) {
        SbfCandidate& to = candidates_[static_cast<std::size_t>(k)];
        for (int y = 0; y < tile.height; ++y) {
            const float* row = sums + SbfSum(size(), y, k, 0);
            for (int x = 0; x < tile.width; ++x) {
                const auto i = static_cast<std::size_t>(tile.y0 + y) * frame_.width + tile.x0 + x;
                const auto o = i - static_cast<std::size_t>(begin_) * frame_.width;
                const float own = 1 / row[x];
                float risk = 0;
                for (std::size_t c = 0; c < 3; ++c) {
                    const float filtered = row[(1 + c) * kPairWidth + x] * own;
                    const float residual = filtered - target_.color[c][i];
                    to.filtered[c][o] = filtered;
                    risk += residual * residual + target_.variance[c][i] * (2 * own - 1);
                }
                to.own[o] = own;
                to.risk[o] = risk * (1.0f / 3.0f);
            }
        }
    }
}

std::vector<Plane> SbfBank::Smooth(const std::vector<const Plane*>& planes, int k, int from, int to,
                                   const CancelToken& cancel) const {
    std::vector<Plane> out(planes.size(),
                           Plane(static_cast<std::size_t>(to - from) * frame_.width));
    const Plane& own = candidates_[static_cast<std::size_t>(k)].own;
    const auto groups = static_cast<int>((planes.size() + kSbfGroup - 1) / kSbfGroup);
    const int count = groups * kSbfGroup;
    ForEachTile(
        frame_, {from, to}, kSbfData + count, kPairTile, cancel,
        [&](const TileArea& tile, TilePlanes& scratch) {
            LoadGuides(tile, &scratch);
            for (std::size_t p = 0; p < static_cast<std::size_t>(count); ++p) {
                // The last group's places must hold something.
                const Plane& plane = *planes[std::min(p, planes.size() - 1)];
                scratch.Load(kSbfData + static_cast<int>(p), plane, frame_.width, end_ - begin_,
                             tile.x0, tile.y0 - begin_, 0);
            }
            AlignedFloats weights = AlignedFloats::Raw(kPairScratch);
            AlignedFloats sums =
                AlignedFloats::Raw(static_cast<std::size_t>(count * kPairWidth * kPairHeight));
            kernels_.smooth(scratch.planes()[0], tables_, k, groups, tile.height, weights.data(),
                            sums.data());
            for (std::size_t p = 0; p < planes.size(); ++p) {
                for (int y = 0; y < tile.height; ++y) {
                    const float* row = sums.data() + (y * count + static_cast<int>(p)) * kPairWidth;
                    const auto i = static_cast<std::size_t>(tile.y0 + y) * frame_.width + tile.x0;
                    const float* share =
                        own.data() + i - static_cast<std::size_t>(begin_) * frame_.width;
                    float* result =
                        out[p].data() + i - static_cast<std::size_t>(from) * frame_.width;
                    for (int x = 0; x < tile.width; ++x) {
                        result[x] = row[x] * share[x];
                    }
                }
            }
        });
    return out;
}

}  // namespace relume::denoise
