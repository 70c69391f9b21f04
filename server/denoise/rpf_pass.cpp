#include "server/denoise/rpf_pass.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>

#include "core/base/parallel.h"
#include "server/denoise/cancelled.h"
#include "server/denoise/rpf_pixel.h"

namespace relume::denoise {
namespace {

constexpr int kTile = 16;           // pixels a side: neighbours that are drawn stay in the cache
constexpr std::size_t kBatch = 64;  // neighbours that are fetched at once
constexpr std::size_t kPositions = 3;
constexpr float kFarPosition = 30, kFar = 3;  // deviations

std::uint64_t Mix(std::uint64_t x) {
    // The finaliser of SplitMix64 (Steele, Lea, Flood 2014).
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return x ^ (x >> 31);
}

// Whole offsets in [-box / 2, box / 2], drawn by a Gaussian of sigma box / 4: a table to pick from
// evenly.
class Offsets {
  public:
    explicit Offsets(int box) {
        const int radius = box / 2;
        const double sigma = box / 4.0;
        std::vector<double> below(1, 0.0);
        for (int d = -radius; d <= radius; ++d) {
            below.push_back(below.back() + std::exp(-d * d / (2 * sigma * sigma)));
        }
        std::size_t at = 0;
        for (std::size_t i = 0; i < kSize; ++i) {
            const double u = (static_cast<double>(i) + 0.5) / kSize * below.back();
            while (below[at + 1] < u) {
                ++at;
            }
            table_[i] = static_cast<int>(at) - radius;
        }
    }
    int operator[](std::uint64_t bits) const { return table_[bits % kSize]; }

    static constexpr std::size_t kSize = 4096;
    static constexpr int kBits = 12;

  private:
    std::array<int, kSize> table_;
};

// First hits like those of a pixel's own samples: at most `reach` from their mean. What comes after
// the first hit in a row may be anything.
struct FirstHits {
    std::array<float, kRpfBlock> mean{}, reach;
};

class Pass {
  public:
    Pass(const RpfSamples& samples, const RpfPass& pass, const std::vector<double>& entropy_terms,
         const RpfKernels& kernels)
        : samples_(samples),
          pass_(pass),
          entropy_terms_(entropy_terms),
          kernels_(kernels),
          offsets_(pass.box) {}

    void FilterPixel(int x, int y, const RpfRows& around, RpfNeighbourhood* near,
                     std::vector<Rgb>* out) const {
        const std::size_t own = around.Of(x, y).size();
        const std::size_t first = samples_.first[samples_.Index(x, y)];
        if (own == 0) {
            return;
        }
        const std::size_t asked = RpfNeighbours(pass_, own);
        near->Clear(own + asked);
        Gather(x, y, asked, around, near);
        near->Normalise(entropy_terms_);
        near->FindWeights(pass_.number, 8 * pass_.variance / static_cast<double>(own),
                          entropy_terms_);
        for (std::size_t i = 0; i < own; ++i) {
            const auto color = near->Filter(i);
            (*out)[first + i] = {color[0], color[1], color[2]};
        }
        if (pass_.spread_spikes) {
            SpreadSpikes(out->data() + first, own);
        }
    }

  private:
    FirstHits LikeOwn(std::span<const RpfRow> own) const {
        FirstHits like;
        like.reach.fill(std::numeric_limits<float>::infinity());
        for (std::size_t f = 0; f < kRpfHit; ++f) {
            if (std::isinf(pass_.near[f])) {
                continue;
            }
            const auto n = static_cast<double>(own.size());
            double sum = 0, squares = 0;
            for (const RpfRow& row : own) {
                sum += row.values[kRpfRowHit + f];
            }
            const double mean = sum / n;
            for (const RpfRow& row : own) {
                squares += (row.values[f] - mean) * (row.values[f] - mean);
            }
            const auto deviation = static_cast<float>(std::sqrt(squares / n));
            const float reach = deviation * (f < kPositions ? kFarPosition : kFar);
            like.mean[f] = static_cast<float>(mean);
            like.reach[f] = deviation > pass_.near[f] ? reach : std::max(reach, pass_.near[f]);
        }
        return like;
    }

    // The pixel's own samples, then of those drawn the ones whose first hit is like theirs.
    void Gather(int x, int y, std::size_t asked, const RpfRows& around,
                RpfNeighbourhood* near) const {
        const auto own = around.Of(x, y);
        for (const RpfRow& row : own) {
            near->Add(row, 0, 0);
        }
        const FirstHits like = LikeOwn(own);
        std::uint64_t key = Mix(static_cast<std::uint64_t>(x) + 1);
        key = Mix(key + static_cast<std::uint64_t>(y) + 1);
        key = Mix(key + static_cast<std::uint64_t>(pass_.number) + 1);
        struct Offset {
            float x, y;
        };
        std::array<Offset, kBatch> offsets;
        std::array<const RpfRow*, kBatch> drawn;
        std::array<const float*, kBatch> hits;
        std::array<std::uint8_t, kBatch> alike;
        for (std::size_t begin = 0; begin < asked; begin += kBatch) {
            std::size_t count = 0;
            for (std::size_t k = begin; k < std::min(begin + kBatch, asked); ++k) {
                const std::uint64_t bits = Mix(key + k * 0x9e3779b97f4a7c15u);
                const int dx = offsets_[bits], dy = offsets_[bits >> Offsets::kBits];
                const int u = x + dx, v = y + dy;
                if ((dx == 0 && dy == 0) || u < 0 || v < 0 || u >= samples_.width ||
                    v >= samples_.height) {
                    continue;
                }
                const auto there = around.Of(u, v);
                if (there.empty()) {
                    continue;
                }
                const RpfRow& row = there[((bits >> 32) * there.size()) >> 32];
                __builtin_prefetch(row.values.data());
                __builtin_prefetch(row.values.data() + kRpfBlock);
                drawn[count] = &row;
                hits[count] = row.values.data();
                offsets[count++] = {static_cast<float>(dx), static_cast<float>(dy)};
            }
            kernels_.alike(hits.data(), static_cast<int>(count), like.mean.data(),
                           like.reach.data(), alike.data());
            for (std::size_t k = 0; k < count; ++k) {
                if (alike[k] != 0) {
                    near->Add(*drawn[k], offsets[k].x, offsets[k].y);
                }
            }
        }
    }

    // Samples of a pixel that are over one deviation from its mean become the mean; what that takes
    // from their sum is given to all alike.
    static void SpreadSpikes(Rgb* colors, std::size_t count) {
        const auto n = static_cast<double>(count);
        std::array<double, 3> mean{}, deviation{}, after{};
        for (std::size_t i = 0; i < count; ++i) {
            for (int c = 0; c < 3; ++c) {
                mean[static_cast<std::size_t>(c)] += colors[i][c] / n;
            }
        }
        for (std::size_t i = 0; i < count; ++i) {
            for (int c = 0; c < 3; ++c) {
                const double d = colors[i][c] - mean[static_cast<std::size_t>(c)];
                deviation[static_cast<std::size_t>(c)] += d * d / n;
            }
        }
        for (double& d : deviation) {
            d = std::sqrt(d);
        }
        for (std::size_t i = 0; i < count; ++i) {
            bool spike = false;
            for (int c = 0; c < 3; ++c) {
                const auto k = static_cast<std::size_t>(c);
                spike = spike || std::abs(colors[i][c] - mean[k]) > deviation[k];
            }
            for (int c = 0; c < 3; ++c) {
                const auto k = static_cast<std::size_t>(c);
                colors[i][c] = spike ? static_cast<float>(mean[k]) : colors[i][c];
                after[k] += colors[i][c] / n;
            }
        }
        for (std::size_t i = 0; i < count; ++i) {
            for (int c = 0; c < 3; ++c) {
                const auto k = static_cast<std::size_t>(c);
                colors[i][c] = static_cast<float>(colors[i][c] + (mean[k] - after[k]));
            }
        }
    }

    const RpfSamples& samples_;
    const RpfPass& pass_;
    const std::vector<double>& entropy_terms_;
    const RpfKernels& kernels_;
    Offsets offsets_;
};

}  // namespace

std::size_t RpfNeighbours(const RpfPass& pass, std::size_t samples) {
    const auto box = static_cast<std::size_t>(pass.box);
    return std::min(box * box * samples / 2, pass.most);
}

std::vector<Rgb> FilterSamples(const RpfSamples& samples, const std::vector<Rgb>& colors,
                               const RpfPass& pass, const std::vector<double>& entropy_terms,
                               const RpfKernels& kernels, const CancelToken& cancel) {
    std::vector<Rgb> out(colors.size());
    const Pass body(samples, pass, entropy_terms, kernels);
    const int radius = pass.box / 2;
    const int across = (samples.width + kTile - 1) / kTile;
    const int down = (samples.height + kTile - 1) / kTile;
    ParallelFor(0, static_cast<std::size_t>(across * down), 1,
                [&](std::size_t begin, std::size_t end) {
                    RpfRows around;
                    RpfNeighbourhood near(pass.sources, kernels);
                    for (std::size_t tile = begin; tile < end; ++tile) {
                        const int x0 = static_cast<int>(tile) % across * kTile;
                        const int y0 = static_cast<int>(tile) / across * kTile;
                        const int x1 = std::min(x0 + kTile, samples.width);
                        const int y1 = std::min(y0 + kTile, samples.height);
                        around.Copy(samples, colors, std::max(x0 - radius, 0),
                                    std::max(y0 - radius, 0), std::min(x1 + radius, samples.width),
                                    std::min(y1 + radius, samples.height));
                        for (int y = y0; y < y1; ++y) {
                            for (int x = x0; x < x1; ++x) {
                                ThrowIfCancelled(cancel);
                                body.FilterPixel(x, y, around, &near, &out);
                            }
                        }
                    }
                });
    return out;
}

}  // namespace relume::denoise
