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
constexpr int kBandRows = 4 * kTileHeight;

// Divides a feature and its variance so that a kernel of `sigma` is exp(-d^2 / max(s, 1)).
void Normalise(float sigma, Plane* feature, Plane* variance) {
    const float floor = kVarianceFloor * 2 * sigma * sigma, scale = 1 / std::sqrt(floor);
    for (float& value : *feature) {
        value = std::clamp(value * scale, -kSbfLargest, kSbfLargest);
    }
    for (float& value : *variance) {
        value = std::clamp(value / kVarianceFloor, 0.0f, kSbfLargest);
    }
}

// Weight of a pixel at each distance from a sample that lies anywhere in the middle one: exp(-2
// d^2) - exp(-8), to 0 at 2 pixels (PBRT's Gaussian filter).
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

SbfGuides MakeSbfGuides(const Frame& frame) {
    SbfGuides guides;
    const std::size_t pixels = frame.pixel_count();
    const auto add = [&](int first, int count, float scale, float sigma, const char* name) {
        for (int f = first; f < first + count; ++f) {
            Plane feature = frame.feature[f], variance = frame.feature_variance[f];
            feature.resize(pixels, 0.0f);
            variance.resize(pixels, 0.0f);
            for (std::size_t i = 0; i < pixels && scale != 1; ++i) {
                feature[i] *= scale;
                variance[i] *= scale * scale;
            }
            Normalise(sigma, &feature, &variance);
            guides.feature.push_back(std::move(feature));
            guides.spread.push_back(std::move(variance));
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

void AddSbfGuide(Plane feature, Plane variance, float sigma, const char* name, SbfGuides* guides) {
    Normalise(sigma, &feature, &variance);
    guides->feature.push_back(std::move(feature));
    guides->spread.push_back(std::move(variance));
    guides->names += (guides->names.empty() ? "" : ", ") + std::string(name);
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

int SbfReach(float sigma) {
    return std::min(kBankRadius, static_cast<int>(std::lround(2 * sigma)));
}

SbfBank::SbfBank(const Frame& frame, const SbfGuides& guides, const SbfTarget& target,
                 const SbfKernels& kernels)
    : frame_(frame), guides_(guides), target_(target), kernels_(kernels), tables_{} {
    tables_.features = static_cast<int>(guides.feature.size());
    const BankTables bank = MakeBankTables();
    std::copy(std::begin(bank.radius), std::end(bank.radius), tables_.radius);
    std::copy(&bank.spatial[0][0][0], &bank.spatial[0][0][0] + sizeof(bank.spatial) / sizeof(float),
              &tables_.spatial[0][0][0]);
}

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
    for (int f = 0; f < tables_.features; ++f) {
        const auto k = static_cast<std::size_t>(f);
        scratch->Load(kSbfFeature + f, guides_.feature[k], frame_.width, frame_.height, tile.x0,
                      tile.y0, f == 6 ? kOutside : 0);
        scratch->Load(kSbfSpread + f, guides_.spread[k], frame_.width, frame_.height, tile.x0,
                      tile.y0, 0);
    }
}

void SbfBank::Extend(int until, const CancelToken& cancel) {
    const RowRange rows{end_, until};
    end_ = until;
    const auto pixels = static_cast<std::size_t>(end_ - begin_) * frame_.width;
    for (SbfCandidate& candidate : candidates_) {
        ForEachPlane(&candidate, [&](Plane& p) { p.resize(pixels); });
    }
    ForEachTile(frame_, rows, kSbfData + kSbfColors, {.halo = kBankRadius}, cancel,
                [&](const TileArea& tile, TilePlanes& scratch) {
                    LoadGuides(tile, &scratch);
                    for (int c = 0; c < kSbfColors; ++c) {
                        scratch.Load(kSbfData + c, frame_.color[c], frame_.width, frame_.height,
                                     tile.x0, tile.y0, 0);
                    }
                    std::vector<float> sums(static_cast<std::size_t>(4 * kCandidates * kTileArea));
                    kernels_.bank(scratch.planes(), scratch.stride(), tables_, tile.height,
                                  sums.data());
                    FinishTile(tile, sums.data());
                });
}

// Weights depend on features alone, so that the derivative of a pixel by its own noise is its
// weight, 1, over the sum of weights.
void SbfBank::FinishTile(const TileArea& tile, const float* sums) {
    for (int k = 0; k < kCandidates; ++k) {
        SbfCandidate& to = candidates_[static_cast<std::size_t>(k)];
        const float* weight = sums + 4 * k * kTileArea;
        for (int y = 0; y < tile.height; ++y) {
            for (int x = 0; x < tile.width; ++x) {
                const auto i = static_cast<std::size_t>(tile.y0 + y) * frame_.width + tile.x0 + x;
                const auto o = i - static_cast<std::size_t>(begin_) * frame_.width;
                const int at = y * kTileWidth + x;
                const float own = 1 / weight[at];
                float risk = 0;
                for (std::size_t c = 0; c < 3; ++c) {
                    const float filtered = weight[(1 + static_cast<int>(c)) * kTileArea + at] * own;
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

std::vector<Plane> SbfBank::Smooth(const std::vector<const Plane*>& planes, float sigma, int from,
                                   int to, const CancelToken& cancel) const {
    SbfTables tables = tables_;
    tables.radius[0] = SbfReach(sigma);
    for (int y = 0; y <= kBankRadius; ++y) {
        for (int x = 0; x <= kBankRadius; ++x) {
            tables.spatial[0][y][x] =
                std::exp(-static_cast<float>(x * x + y * y) / (2 * sigma * sigma));
        }
    }
    std::vector<Plane> out(planes.size(),
                           Plane(static_cast<std::size_t>(to - from) * frame_.width));
    ForEachTile(
        frame_, {from, to}, kSbfData + kSbfSmoothed, {.halo = kBankRadius}, cancel,
        [&](const TileArea& tile, TilePlanes& scratch) {
            LoadGuides(tile, &scratch);
            for (std::size_t p = 0; p < planes.size(); ++p) {
                scratch.Load(kSbfData + static_cast<int>(p), *planes[p], frame_.width,
                             end_ - begin_, tile.x0, tile.y0 - begin_, 0);
            }
            std::vector<float> means(static_cast<std::size_t>(kSbfSmoothed * kTileArea));
            kernels_.smooth(scratch.planes(), scratch.stride(), tables, tile.height, means.data());
            for (std::size_t p = 0; p < planes.size(); ++p) {
                for (int y = 0; y < tile.height; ++y) {
                    const float* row = means.data() + p * kTileArea + y * kTileWidth;
                    std::copy_n(row, tile.width,
                                out[p].begin() +
                                    static_cast<std::ptrdiff_t>(tile.y0 + y - from) * frame_.width +
                                    tile.x0);
                }
            }
        });
    return out;
}

}  // namespace relume::denoise
