#include "server/denoise/rpf_pass.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/base/parallel.h"
#include "server/denoise/cancelled.h"
#include "server/denoise/rpf_pixel.h"

namespace relume::denoise {
namespace {

constexpr int kTile = 16;             // pixels a side: neighbours that are drawn stay in the cache
constexpr std::size_t kFirstHit = 9;  // columns of features: position, normal, albedo
constexpr float kNear = 0.1f;         // of a feature: differences that never matter
constexpr float kFarPosition = 30, kFar = 3;  // deviations
// Features that vary less are constant but for rounding.
constexpr double kFeatureFloor = 1e-4;

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

// Mean and spread of the first hits of a pixel's own samples, and who is like them.
struct FirstHits {
    std::array<float, kFirstHit> mean{}, reach{};  // deviations from the mean that are too far

    bool Includes(const std::array<float, kRpfColumnCount>& sample) const {
        for (std::size_t f = 0; f < kFirstHit; ++f) {
            if (std::abs(sample[kRpfFeature + f] - mean[f]) > reach[f]) {
                return false;
            }
        }
        return true;
    }
};

class Pass {
  public:
    Pass(const RpfSamples& samples, const std::vector<Rgb>& colors, const RpfPass& pass,
         const std::vector<double>& entropy_terms, RpfKernel kernel)
        : samples_(samples),
          colors_(colors),
          pass_(pass),
          entropy_terms_(entropy_terms),
          kernel_(kernel),
          offsets_(pass.box) {
        floors_.fill(0);
        std::fill_n(floors_.begin() + kRpfFeature, kRpfRandom - kRpfFeature, kFeatureFloor);
    }

    void FilterPixel(int x, int y, RpfNeighbourhood* near, std::vector<Rgb>* out) const {
        const std::size_t pixel = Index(x, y);
        const std::size_t own = samples_.CountOf(pixel), first = samples_.first[pixel];
        if (own == 0) {
            return;
        }
        const std::size_t asked = RpfNeighbours(pass_, own);
        near->Clear(own);
        near->Reserve(own + asked);
        Gather(x, y, own, asked, near);
        near->Normalise(floors_);
        near->FindWeights(pass_.number, 8 * pass_.variance / static_cast<double>(own),
                          entropy_terms_);
        for (std::size_t i = 0; i < own; ++i) {
            const auto color = near->Filter(i, kernel_);
            (*out)[first + i] = {color[0], color[1], color[2]};
        }
        if (pass_.spread_spikes) {
            SpreadSpikes(out->data() + first, own);
        }
    }

  private:
    std::size_t Index(int x, int y) const {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(samples_.width) +
               static_cast<std::size_t>(x);
    }

    // A sample's columns; (dx, dy): of its pixel from the one that is filtered. What is not to be
    // looked at is 0.
    std::array<float, kRpfColumnCount> Read(std::size_t sample, int dx, int dy) const {
        const SampleRecord& record = *samples_.records[sample];
        const Rgb& color = colors_[sample];
        std::array<float, kRpfColumnCount> out{};
        for (int c = 0; c < 3; ++c) {
            out[kRpfColor + static_cast<std::size_t>(c)] = color[c];
        }
        for (std::size_t hit = 0; hit < 2; ++hit) {
            float* to = out.data() + kRpfFeature + hit * kFirstHit;
            for (int c = 0; c < 3; ++c) {
                to[c] = samples_.use_position
                            ? record.hits[hit].position[c] * (kNear / samples_.position_unit)
                            : 0;
                to[3 + c] = samples_.use_normal ? record.hits[hit].normal[c] : 0;
                to[6 + c] = samples_.use_albedo ? record.hits[hit].albedo[c] : 0;
            }
        }
        std::copy_n(record.random, 5, out.begin() + kRpfRandom);
        out[kRpfScreen] = static_cast<float>(dx) + record.x;
        out[kRpfScreen + 1] = static_cast<float>(dy) + record.y;
        return out;
    }

    // The pixel's own samples, then of those drawn the ones whose first hit is like theirs.
    void Gather(int x, int y, std::size_t own, std::size_t asked, RpfNeighbourhood* near) const {
        const std::size_t first = samples_.first[Index(x, y)];
        std::array<double, kFirstHit> sum{}, squares{};
        for (std::size_t i = 0; i < own; ++i) {
            const auto sample = Read(first + i, 0, 0);
            for (std::size_t f = 0; f < kFirstHit; ++f) {
                sum[f] += sample[kRpfFeature + f];
            }
            near->Add(sample);
        }
        FirstHits hits;
        const auto n = static_cast<double>(own);
        for (std::size_t i = 0; i < own; ++i) {
            const auto sample = Read(first + i, 0, 0);
            for (std::size_t f = 0; f < kFirstHit; ++f) {
                const double d = sample[kRpfFeature + f] - sum[f] / n;
                squares[f] += d * d;
            }
        }
        for (std::size_t f = 0; f < kFirstHit; ++f) {
            const auto deviation = static_cast<float>(std::sqrt(squares[f] / n));
            const float reach = deviation * (f < 3 ? kFarPosition : kFar);
            hits.mean[f] = static_cast<float>(sum[f] / n);
            hits.reach[f] = deviation > kNear ? reach : std::max(reach, kNear);
        }
        std::uint64_t key = Mix(static_cast<std::uint64_t>(x) + 1);
        key = Mix(key + static_cast<std::uint64_t>(y) + 1);
        key = Mix(key + static_cast<std::uint64_t>(pass_.number) + 1);
        for (std::size_t k = 0; k < asked; ++k) {
            const std::uint64_t bits = Mix(key + k * 0x9e3779b97f4a7c15u);
            const int dx = offsets_[bits], dy = offsets_[bits >> Offsets::kBits];
            const int u = x + dx, v = y + dy;
            if ((dx == 0 && dy == 0) || u < 0 || v < 0 || u >= samples_.width ||
                v >= samples_.height) {
                continue;
            }
            const std::size_t pixel = Index(u, v);
            const std::uint64_t pick = ((bits >> 32) * samples_.CountOf(pixel)) >> 32;
            if (samples_.CountOf(pixel) == 0) {
                continue;
            }
            const auto sample = Read(samples_.first[pixel] + pick, dx, dy);
            if (hits.Includes(sample)) {
                near->Add(sample);
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
    const std::vector<Rgb>& colors_;
    const RpfPass& pass_;
    const std::vector<double>& entropy_terms_;
    RpfKernel kernel_;
    Offsets offsets_;
    std::array<double, kRpfColumnCount> floors_;
};

}  // namespace

std::size_t RpfNeighbours(const RpfPass& pass, std::size_t samples) {
    const double asked = pass.neighbours * 0.5 * pass.box * pass.box * static_cast<double>(samples);
    return std::min(static_cast<std::size_t>(asked), kMostRpfNeighbours);
}

std::vector<Rgb> FilterSamples(const RpfSamples& samples, const std::vector<Rgb>& colors,
                               const RpfPass& pass, const std::vector<double>& entropy_terms,
                               RpfKernel kernel, const CancelToken& cancel) {
    std::vector<Rgb> out(colors.size());
    const Pass body(samples, colors, pass, entropy_terms, kernel);
    const int across = (samples.width + kTile - 1) / kTile;
    const int down = (samples.height + kTile - 1) / kTile;
    ParallelFor(0, static_cast<std::size_t>(across * down), 1,
                [&](std::size_t begin, std::size_t end) {
                    RpfNeighbourhood near;
                    for (std::size_t tile = begin; tile < end; ++tile) {
                        const int x0 = static_cast<int>(tile) % across * kTile;
                        const int y0 = static_cast<int>(tile) / across * kTile;
                        for (int y = y0; y < std::min(y0 + kTile, samples.height); ++y) {
                            for (int x = x0; x < std::min(x0 + kTile, samples.width); ++x) {
                                ThrowIfCancelled(cancel);
                                body.FilterPixel(x, y, &near, &out);
                            }
                        }
                    }
                });
    return out;
}

}  // namespace relume::denoise
