#include "server/denoise/bilateral_bank.h"

#include <algorithm>
#include <cmath>

#include "core/base/clones.h"

namespace relume::denoise {
namespace {

// Li, Wu, Chuang 2012, section 5: sigma of normal, albedo, depth; floor of a pair's variance
// (methods 2.4).
constexpr float kFeatureSigma[3] = {0.8f, 0.25f, 0.6f};
constexpr float kVarianceFloor = 1e-2f;

// Of the filtered colours: the robust filter multiplies three of them.
constexpr float kLargestNoise = 1e10f;

// Rows of a tile, from sums of weights: a pixel's own share, which is the derivative of the
// filtered pixel by its own noise, since weights depend on features alone;
RELUME_CLONES void FinishOwn(int width, const float* __restrict weight, float* __restrict own) {
    for (int x = 0; x < width; ++x) {
        own[x] = 1 / weight[x];
    }
}

// the filtered colour, and what it adds to three times SURE.
RELUME_CLONES void FinishChannel(int width, const float* __restrict sum,
                                 const float* __restrict own, const float* __restrict color,
                                 const float* __restrict variance, float* __restrict filtered,
                                 float* __restrict sure) {
    for (int x = 0; x < width; ++x) {
        filtered[x] = sum[x] * own[x];
        const float residual = filtered[x] - color[x];
        sure[x] += residual * residual + variance[x] * (2 * own[x] - 1);
    }
}

void FinishTile(const Frame& frame, const TileArea& tile, const float* sums, CandidateBank* bank) {
    for (int y = 0; y < tile.height; ++y) {
        const auto i = static_cast<std::size_t>(tile.y0 + y) * frame.width + tile.x0;
        for (int k = 0; k < kCandidates; ++k) {
            FinishOwn(tile.width, sums + BankSum(y, k, 0), bank->self[k].data() + i);
            float* sure = bank->sure[k].data() + i;
            std::fill_n(sure, tile.width, 0.0f);
            for (int c = 0; c < 3; ++c) {
                FinishChannel(tile.width, sums + BankSum(y, k, 1 + c), bank->self[k].data() + i,
                              frame.color[c].data() + i, frame.variance[c].data() + i,
                              bank->filtered[k][c].data() + i, sure);
            }
            for (int x = 0; x < tile.width; ++x) {
                sure[x] *= 1.0f / 3.0f;
            }
        }
    }
}

}  // namespace

BankTables MakeBankTables() {
    BankTables tables{};
    for (int k = 0; k < kCandidates; ++k) {
        const float sigma = CandidateSigma(k);
        tables.radius[k] = std::min(kBankRadius, static_cast<int>(std::lround(2 * sigma)));
        for (int y = 0; y <= kBankRadius; ++y) {
            for (int x = 0; x <= kBankRadius; ++x) {
                tables.spatial[k][y][x] =
                    std::exp(-static_cast<float>(x * x + y * y) / (2 * sigma * sigma));
            }
        }
    }
    for (int g = 0; g < 3; ++g) {
        tables.floor[g] = kVarianceFloor * 2 * kFeatureSigma[g] * kFeatureSigma[g];
    }
    return tables;
}

// Half of the pairs, and an error that differs by less than 1 % from that of full windows
// (geometric mean of twelve scenes, at 8 and at 32 samples).
BankTables MakeThinBankTables() {
    BankTables tables = MakeBankTables();
    for (int y = 0; y <= kBankRadius; ++y) {
        for (int x = 0; x <= kBankRadius; ++x) {
            const auto distance = std::sqrt(static_cast<float>(x * x + y * y));
            float weight = 1;
            if (distance > 16.5f) {
                weight = 0;
            } else if (distance > 13.5f) {
                weight = x % 2 == 0 && y % 2 == 0 ? 4.0f : 0.0f;
            } else if (distance > 10.5f) {
                weight = (x + y) % 2 == 0 ? 2.0f : 0.0f;
            }
            for (auto& spatial : tables.spatial) {
                spatial[y][x] *= weight;
            }
        }
    }
    return tables;
}

Guides MakeBankGuides(const Frame& frame) {
    Guides guides = MakeGuides(frame);
    for (int g = 0; g < 3; ++g) {
        for (float& value : guides.variance[g]) {
            value *= 2 * kFeatureSigma[g] * kFeatureSigma[g];
        }
    }
    return guides;
}

void LoadBankPlanes(const Frame& frame, const Guides& guides, const TileArea& tile,
                    TilePlanes* scratch) {
    const auto load = [&](int index, const Plane& plane, float outside = 0) {
        scratch->Load(index, plane, frame.width, frame.height, tile.x0, tile.y0, outside);
    };
    for (int c = 0; c < 3; ++c) {
        load(kBankColor + c, frame.color[c]);
        load(kBankSpread + c, guides.variance[c]);
    }
    for (int f = 0; f < 7; ++f) {
        load(kBankNormal + f, guides.feature[f], f == 6 ? kOutside : 0);
    }
}

FilteredColors FilterBySmallest(const Frame& frame, const Guides& guides, const BankTables& tables,
                                const BilateralKernels& kernels, const CancelToken& cancel) {
    FilteredColors out;
    out.share.resize(frame.pixel_count());
    for (std::size_t c = 0; c < 3; ++c) {
        out.color[c].resize(frame.pixel_count());
        out.variance[c].resize(frame.pixel_count());
    }
    ForEachTile(
        frame, kGuidePlanes, tables.radius[0], cancel,
        [&](const TileArea& tile, TilePlanes& scratch) {
            LoadBankPlanes(frame, guides, tile, &scratch);
            for (int c = 0; c < 3; ++c) {
                scratch.Load(kBankNoise + c, frame.variance[c], frame.width, frame.height, tile.x0,
                             tile.y0, 0);
            }
            std::vector<float> sums(static_cast<std::size_t>(kGuideSums * kTileArea));
            kernels.guide(scratch.planes(), scratch.stride(), tables, tile.height, sums.data());
            for (int y = 0; y < tile.height; ++y) {
                for (int x = 0; x < tile.width; ++x) {
                    const auto i =
                        static_cast<std::size_t>(tile.y0 + y) * frame.width + tile.x0 + x;
                    const float* at = sums.data() + y * kTileWidth + x;
                    const float inverse = 1 / at[0];
                    out.share[i] = inverse;
                    for (std::size_t c = 0; c < 3; ++c) {
                        out.color[c][i] = at[(1 + c) * kTileArea] * inverse;
                        out.variance[c][i] =
                            std::min(at[(4 + c) * kTileArea] * inverse * inverse, kLargestNoise);
                    }
                }
            }
        });
    return out;
}

float CandidateSigma(int k) { return std::exp2(0.5f * static_cast<float>(k)); }

CandidateBank ComputeBank(const Frame& frame, const BilateralKernels& kernels,
                          const CancelToken& cancel) {
    const Guides guides = MakeBankGuides(frame);
    CandidateBank bank;
    bank.features = guides.names;
    for (int k = 0; k < kCandidates; ++k) {
        bank.sure[k].resize(frame.pixel_count());
        bank.self[k].resize(frame.pixel_count());
        for (Plane& plane : bank.filtered[k]) {
            plane.resize(frame.pixel_count());
        }
    }
    const BankTables tables = MakeThinBankTables();
    ForEachTile(frame, {0, frame.height}, kBankPlanes, kPairTile, cancel,
                [&](const TileArea& tile, TilePlanes& planes) {
                    LoadBankPlanes(frame, guides, tile, &planes);
                    AlignedFloats scratch = AlignedFloats::Raw(kPairScratch);
                    AlignedFloats sums = AlignedFloats::Raw(BankSum(kPairHeight, 0, 0));
                    kernels.bank(planes.planes()[0], tables, tile.width, tile.height,
                                 scratch.data(), sums.data());
                    FinishTile(frame, tile, sums.data(), &bank);
                });
    return bank;
}

}  // namespace relume::denoise
